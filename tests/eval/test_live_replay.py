"""The replay client: frames sent, errors of the answers, and messages where there is no service."""

import asyncio
import socket
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from configs.errors import InputError
from datasets.formats.bvh import write_bvh
from datasets.motion.clip import BodyMotion
from datasets.motion.humanoid import BODY_NAMES
from datasets.motion.rotation import conjugate, heading, multiply, rotation_angle
from datasets.motion.t_pose import PELVIS_HEIGHT, STANDING_HEIGHT
from datasets.retarget.humanoid_bvh import to_humanoid_bvh
from datasets.trackers.calibration import calibrate_trackers, calibrated_joint_poses
from datasets.trackers.lower_body import toe_contacts
from datasets.trackers.trackers import HEAD_TRACKER, PELVIS_TRACKER, TrackerPoses, tracker_poses
from eval import live_replay
from eval.live.client import play
from eval.live.virtual_user import measure_answers, replay_as_trackers
from tests.eval.live.live_parts import HOST, CheapBodies, run, serving


def standing(frames: int, yaw: float = 0.0) -> BodyMotion:
    """Return somebody who stands still at (2, 1), hands down, facing ``yaw``."""
    rotations = np.zeros((frames, 20, 4))
    rotations[..., 0] = 1.0
    rotations[:, 0] = [np.cos(yaw / 2), 0, 0, np.sin(yaw / 2)]
    for side, sign in (("l", -1.0), ("r", 1.0)):
        rotations[:, BODY_NAMES.index(f"upper_arm_{side}")] = [np.cos(0.6), sign * np.sin(0.6), 0, 0]
    return BodyMotion(np.tile([2.0, 1.0, PELVIS_HEIGHT], (frames, 1)), rotations, 45.0, "standing")


def test_performance_begins_with_a_t_pose_in_place() -> None:
    clip = standing(60, 1.0)
    done = replay_as_trackers(clip, 1.25 * STANDING_HEIGHT, 3)
    assert abs(done.scale - 1.25) < 1e-9
    assert len(done.trackers.positions) == done.first_clip_frame + 60
    found = calibrate_trackers(TrackerPoses(*(part[:45] for part in done.trackers)))
    assert abs(found.scale / 1.25 - 1) < 0.04
    joints = calibrated_joint_poses(found, done.trackers)
    true = tracker_poses(clip)
    for number in (
        0,
        done.first_clip_frame,
        done.first_clip_frame + 59,
    ):  # in the T-pose and in the clip, pelvis and head are where the clip's are
        assert (
            np.linalg.norm(
                joints.positions[number, [HEAD_TRACKER, PELVIS_TRACKER]] - true.positions[0, [HEAD_TRACKER, PELVIS_TRACKER]], axis=-1
            ).max()
            < 0.15
        )
        assert abs(heading(joints.rotations[number, PELVIS_TRACKER]) - 1.0) < 0.2
    steps = np.linalg.norm(np.diff(done.trackers.positions, axis=0), axis=-1)
    assert steps.max() < 0.15  # nobody jumps on the way
    turns = rotation_angle(multiply(done.trackers.rotations[1:], conjugate(done.trackers.rotations[:-1])))
    assert turns.max() < 0.25


def test_score_by_hand() -> None:
    clip = standing(10)
    done = replay_as_trackers(clip, 2.0 * STANDING_HEIGHT, 0)
    frames = np.array([2, 5, 7])
    roots = 2.0 * clip.root_position[frames] + [0.03, 0.0, 0.04]  # 5 cm off, the feet with it
    contacts = toe_contacts(clip)[frames].copy()
    contacts[0, 0] ^= True  # one of six
    found = measure_answers(done, frames, roots, clip.local_rotations[frames], contacts)
    assert found.frames == 3
    assert abs(found.toe_error) < 1e-9
    assert abs(found.toe_error_world - 0.05) < 1e-9
    assert abs(found.contact_accuracy - 5 / 6) < 1e-9
    # Knees bent by 60 degrees: ankle and toe turn about the knee. From there the toe-base is 41 + 6 cm below and 13 cm ahead, so
    # sqrt(47^2 + 13^2) cm away, and its chord is as long at 60 degrees; the user is twice as large.
    bent = clip.local_rotations[frames].copy()
    for side in "lr":
        bent[:, BODY_NAMES.index(f"shin_{side}")] = [np.cos(np.pi / 6), 0, np.sin(np.pi / 6), 0]
    found = measure_answers(done, frames, 2.0 * clip.root_position[frames], bent, contacts)
    assert abs(found.toe_error - 2.0 * np.hypot(0.47, 0.13)) < 1e-9
    assert abs(found.toe_error_world - found.toe_error) < 1e-9


def test_every_frame_is_sent_and_answered() -> None:
    async def test() -> None:
        async with serving() as service:
            done = replay_as_trackers(standing(45), 1.7, 0)
            played = await play(done.trackers, HOST, service.port, speed=3.0, name="Ann\n")
            assert sorted(played.answers) == list(range(len(done.trackers.positions)))
            assert len(played.latencies_ms) == len(played.sent_times) == len(played.answers)
            assert 60.0 < played.rate < 140.0
            assert min(played.latencies_ms) > 0.0
            assert service.notes[0] == "user 1 (Ann): came"
            last = played.answers[len(played.answers) - 1]
            np.testing.assert_allclose(last["root"], done.trackers.positions[-1, PELVIS_TRACKER], atol=1e-4)
            lines = live_replay.format_report(done, played)
            assert any(line.startswith("toes: ") for line in lines)
            await service.until(lambda: service.server.users == 0)

    run(test())


def test_trackers_on_feet_and_imus_on_shins_are_worn() -> None:
    async def test() -> None:
        async with serving() as service:
            worn, imus = live_replay.choose_trackers(live_replay.TRACKER, live_replay.IMU)
            done = replay_as_trackers(standing(10), 1.7, 0, legs=True, imus=imus)
            played = await play(done.trackers, HOST, service.port, speed=3.0, name="Ann", worn=worn)
            assert sorted(played.answers) == list(range(len(done.trackers.positions)))
            assert not played.messages
            assert service.notes[0] == "user 1 (Ann): came, with foot_l, foot_r, shin_l, shin_r"
            solver = service.server.solver
            assert isinstance(solver, CheapBodies)
            assert solver.worn == [True] * 8
            assert imus == ["shin_l", "shin_r"]
            assert np.isnan(done.trackers.positions[:, 6:]).all()

    run(test())


def test_only_what_is_worn_is_told() -> None:
    assert live_replay.choose_trackers("none", "none") == (["head", "hand_l", "hand_r", "pelvis"], [])
    assert live_replay.choose_trackers("imu", "none", pelvis=False) == (
        ["head", "hand_l", "hand_r", "foot_l", "foot_r"],
        ["foot_l", "foot_r"],
    )


def test_a_service_that_hangs_up() -> None:
    async def test() -> None:
        async with serving() as service:
            done = replay_as_trackers(standing(200), 1.7, 0)
            playing = asyncio.create_task(play(done.trackers, HOST, service.port))
            await service.until(lambda: service.server.answered > 5)
            await service.server.stop()
            played = await playing
            assert played.messages == ["the service stops"]
            assert 5 < len(played.answers) < len(done.trackers.positions)

    run(test())


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["--port", "{closed}"], "nobody listens"),
        (["--port", "0"], "--port is 0"),
        (["--port", "{closed}", "--height", "1.7"], "--height is 1.7, should be 100 to 230 cm"),
        (["--port", "{closed}", "--speed", "0"], "--speed is 0.0"),
        (["--port", "{closed}", "--seed", "-1"], "--seed is -1"),
        (["--port", "{closed}", "--name", "dance"], "--name dance: no such clip; there are standing"),
    ],
)
def test_bad_arguments(arguments: list[str], told: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_bvh(tmp_path / "standing.bvh", to_humanoid_bvh(standing(90)))
    with socket.create_server(("127.0.0.1", 0)) as server:
        closed = server.getsockname()[1]
    given = [argument.format(closed=closed) for argument in arguments]
    assert live_replay.main([str(tmp_path / "standing.bvh"), *given]) == 2
    said = capsys.readouterr().err
    assert said.startswith("error: ")
    assert said.count("\n") == 1
    assert told in said


def test_another_service() -> None:
    async def answers(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        writer.write(b"220 mail.example ESMTP\r\n")
        await reader.read()
        writer.close()

    async def test() -> None:
        server = await asyncio.start_server(answers, HOST, 0)
        with pytest.raises(InputError, match="something listens, but is no live service"):
            await play(replay_as_trackers(standing(5), 1.7, 0).trackers, HOST, server.sockets[0].getsockname()[1])
        server.close()
        await asyncio.sleep(0.05)

    run(test())


def test_longest_clip() -> None:
    clips = [standing(10), replace(standing(20), name="other"), standing(15)]
    assert live_replay.choose_clip(clips, None).name == "other"
    assert len(live_replay.choose_clip(clips, "standing")) == 15
