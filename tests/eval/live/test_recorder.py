"""Recordings of the live service: whole, at the user's size, under names of their own, and nothing of who never got live."""

import asyncio
import os
from pathlib import Path

import numpy as np
import pytest

from configs.errors import InputError
from datasets.formats.bvh import read_bvh
from datasets.library.sources import load_clips
from datasets.motion.humanoid import BODY_NAMES, SKELETON
from eval.live.recorder import SPOOL_SUFFIX, Recorder, main, save_recording
from tests.eval.live.live_parts import CALIBRATION, SCALE, WARM, run, serving


def bvhs(folder: Path) -> list[Path]:
    """Return the recordings of a folder in which nothing else may be."""
    files = sorted(folder.iterdir())
    assert [file for file in files if file.suffix != ".bvh"] == []
    return files


def turned(frames: int) -> np.ndarray:
    """Return rotations (frames, 20, 4) of which the left thigh's swings."""
    rotations = np.zeros((frames, 20, 4))
    rotations[..., 0] = 1.0
    angle = np.linspace(0.0, 1.0, frames)
    rotations[:, BODY_NAMES.index("thigh_l")] = np.stack([np.cos(angle / 2), 0 * angle, np.sin(angle / 2), 0 * angle], axis=-1)
    return rotations


def test_session_is_saved_when_it_ends(tmp_path: Path) -> None:
    async def test() -> None:
        async with serving(record=tmp_path / "takes") as service:
            client = await service.client(name="Ann")
            await client.frames(CALIBRATION + WARM + 30)
            client.writer.close()
            await service.until(lambda: any(note.startswith("saved") for note in service.notes))
            assert service.notes[-1].endswith(": 0.7 s")  # 30 frames of 1/45 s

    run(test())
    (file,) = bvhs(tmp_path / "takes")
    bvh = read_bvh(file)
    assert len(bvh.values) == 30
    assert abs(bvh.frame_time - 1 / 45) < 1e-9
    # Centimetres, Y up: offsets of 1.25 times the standard skeleton's, the pelvis where the tracker was, 1 m up
    thigh = 100 * SCALE * SKELETON.offsets[BODY_NAMES.index("thigh_l")]
    np.testing.assert_allclose(bvh.offsets[bvh.names.index("thigh_l")], [thigh[1], thigh[2], thigh[0]], atol=1e-5)
    np.testing.assert_allclose(bvh.values[:, :3], np.tile([0.0, 100.0, 0.0], (30, 1)), atol=1e-4)


def test_recording_reads_like_any_clip(tmp_path: Path) -> None:
    async def test() -> None:
        recorder = Recorder(tmp_path, lambda _: None)
        root = np.stack([np.linspace(0, 1, 90), np.zeros(90), np.full(90, 0.95 * 1.1)], axis=-1)
        for place, rotations in zip(root, turned(90), strict=True):
            recorder.record(1, place, rotations, 1.1)
        await recorder.finish()

    run(test())
    (clip,) = load_clips(bvhs(tmp_path)[0], fps=45.0)
    assert len(clip) == 90
    way = clip.root_position[-1] - clip.root_position[0]  # 1 m at the user's size is 1 m / 1.1 at the standard one
    np.testing.assert_allclose(way, [1 / 1.1, 0, 0], atol=2e-3)
    thigh = clip.local_rotations[:, BODY_NAMES.index("thigh_l")]
    np.testing.assert_allclose(2 * np.arctan2(thigh[:, 2], thigh[:, 0]), np.linspace(0, 1, 90), atol=1e-3)


def test_who_never_got_live_leaves_nothing(tmp_path: Path) -> None:
    async def test() -> None:
        async with serving(record=tmp_path) as service:
            client = await service.client()
            await client.frames(CALIBRATION + WARM)

    run(test())
    assert bvhs(tmp_path) == []


def test_each_calibration_and_each_user_has_a_file(tmp_path: Path) -> None:
    async def test() -> None:
        async with serving(record=tmp_path) as service:
            ann, bob = await service.client(), await service.client()
            for client in (ann, bob):
                await client.frames(CALIBRATION + WARM + 10)
            ann.send({"calibrate": True})
            await ann.frames(CALIBRATION + WARM + 20)

    run(test())
    assert sorted(len(read_bvh(file).values) for file in bvhs(tmp_path)) == [10, 10, 20]


def test_long_recordings_go_on_in_another_file(tmp_path: Path) -> None:
    async def test() -> None:
        async with serving(record=tmp_path, minutes=20 / 45 / 60) as service:  # 20 frames
            client = await service.client()
            await client.frames(CALIBRATION + WARM + 50)

    run(test())
    assert sorted(len(read_bvh(file).values) for file in bvhs(tmp_path)) == [10, 20, 20]


def test_a_full_disk_stops_the_recording_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(self: Recorder, user: int) -> None:
        raise OSError(28, os.strerror(28))

    async def test() -> None:
        async with serving(record=tmp_path) as service:
            client = await service.client()
            assert [answer["state"] for answer in await client.frames(CALIBRATION + WARM + 10)][-1] == "live"
            assert service.notes.count("recording of user 1 stops: No space left on device") == 1

    monkeypatch.setattr(Recorder, "_begin", full)
    run(test())
    assert bvhs(tmp_path) == []


def test_nothing_is_overwritten(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("eval.live.recorder.time.strftime", lambda _: "now")
    (tmp_path / "now_user1.bvh").write_text("precious")

    async def test() -> None:
        for _ in range(2):
            recorder = Recorder(tmp_path, lambda _: None)
            for rotations in turned(5):
                recorder.record(1, np.ones(3), rotations, 1.0)
            await recorder.finish()

    run(test())
    assert [file.name for file in bvhs(tmp_path)] == ["now_user1.bvh", "now_user1_2.bvh", "now_user1_3.bvh"]
    assert (tmp_path / "now_user1.bvh").read_text() == "precious"


def test_take_that_a_crash_left(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    async def test() -> None:
        recorder = Recorder(tmp_path, lambda _: None)
        for rotations in turned(5):
            recorder.record(1, np.ones(3), rotations, 1.0)
        for take in recorder._recordings.values():
            take.file.close()

    asyncio.run(test())
    (take,) = tmp_path.iterdir()
    with take.open("r+b") as file:
        file.truncate(take.stat().st_size - 7)  # in the midst of the fifth frame
    assert main([str(take)]) == 0
    (file,) = bvhs(tmp_path)
    assert len(read_bvh(file).values) == 4
    assert main([str(take)]) == 2
    assert "no recording" in capsys.readouterr().err


def test_bad_takes(tmp_path: Path) -> None:
    empty = tmp_path / f".empty{SPOOL_SUFFIX}"
    empty.touch()
    with pytest.raises(InputError, match="holds no frame"):
        save_recording(empty)
    (tmp_path / "empty.bvh").touch()
    with pytest.raises(InputError, match="is there already"):
        save_recording(empty)


def test_folder_that_cannot_be(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(InputError, match=r"--record .*file/takes: cannot be made"):
        Recorder(tmp_path / "file" / "takes", print)
