"""Pictures of the humanoid: their content, and the message where none can be made."""

import subprocess
from pathlib import Path

import imageio_ffmpeg
import mediapy
import numpy as np
import pytest

from datasets.motion.generalised_positions import motion_to_qpos
from datasets.motion.humanoid import HINGE_NAMES
from eval.pages import render
from eval.pages.render import AGENT_COLOUR, LOST_COLOUR, REFERENCE_COLOUR, encode_mp4, render_pair, save_strip
from tests.builders import posed

SIZE = (160, 96)


@pytest.fixture(scope="module")
def clip() -> np.ndarray:
    """Return the poses of one standing second."""
    if not render.can_render():
        pytest.skip(render.INSTALL_HINT)
    return motion_to_qpos(posed({"upper_arm_l_x": -60.0, "upper_arm_r_x": 60.0}, frames=61))


def share_of(colour: tuple[float, ...], picture: np.ndarray) -> float:
    """Return the share of pixels whose hue is a colour's: whose channels differ from each other as its channels do, lit or not."""
    pixels = picture.reshape(-1, 3) / 255.0
    wanted = np.array(colour[:3]) - np.mean(colour[:3])
    found = pixels - pixels.mean(axis=1, keepdims=True)
    return float(np.mean(np.linalg.norm(found - wanted, axis=1) < 0.12))


def test_poses_are_root_then_hinges() -> None:
    found = motion_to_qpos(posed({"shin_l_y": 30.0}, frames=2, height=1.5))
    expected = np.zeros((2, 50))
    expected[:, 2], expected[:, 3] = 1.5, 1.0  # 1.5 m up, not turned
    expected[:, 7 + HINGE_NAMES.index("shin_l_y")] = np.pi / 6
    np.testing.assert_allclose(found, expected, atol=1e-12)


def test_the_reference_stands_left_and_the_agent_right_on_a_textured_ground(clip: np.ndarray) -> None:
    frames = render_pair(clip, clip, 60.0, size=SIZE)
    assert frames.shape == (31, 96, 160, 3)  # a second at 60 fps, first and last frame included: 0, 2, ... 60
    left, right = frames[0, :, :80], frames[0, :, 80:]
    assert share_of(AGENT_COLOUR, right) > 0.02
    assert share_of(AGENT_COLOUR, left) < 0.001
    ground = frames[0, 80:].reshape(-1, 3).mean(axis=1)
    assert ground.std() > 2.0  # of 255: a checkerboard


def test_a_lost_agent_changes_its_colour(clip: np.ndarray) -> None:
    frames = render_pair(clip[:8], clip[:8], 60.0, lost=np.arange(8) >= 4, size=SIZE)
    assert share_of(LOST_COLOUR, frames[1]) < 0.001  # frame 2 of the clip
    assert share_of(LOST_COLOUR, frames[2]) > 0.01  # frame 4
    assert share_of(AGENT_COLOUR, frames[2]) < 0.001


def test_the_camera_follows_a_walk(clip: np.ndarray) -> None:
    walk = clip.copy()
    walk[:, 0] += np.linspace(0.0, 20.0, len(walk))
    frames = render_pair(walk, walk, 60.0, size=SIZE)
    assert share_of(AGENT_COLOUR, frames[15]) == pytest.approx(share_of(AGENT_COLOUR, frames[0]), rel=0.5)


def test_a_video_comes_back_with_its_frames(clip: np.ndarray, tmp_path: Path) -> None:
    frames = render_pair(clip[:20], clip[:20], 60.0, size=SIZE)
    video = encode_mp4(frames)
    assert video[4:8] == b"ftyp"
    (tmp_path / "video.mp4").write_bytes(video)
    command = [
        imageio_ffmpeg.get_ffmpeg_exe(),
        "-v",
        "error",
        "-i",
        str(tmp_path / "video.mp4"),
        "-f",
        "rawvideo",
        "-pix_fmt",
        "rgb24",
        "-",
    ]
    decoded = np.frombuffer(subprocess.run(command, capture_output=True, check=True).stdout, np.uint8).reshape(frames.shape)
    assert np.abs(decoded.astype(float) - frames).mean() < 6.0  # of 255; the coding loses a little


def test_a_strip_of_pictures_is_written(clip: np.ndarray, tmp_path: Path) -> None:
    moved = clip.copy()
    moved[:, 2] += 0.5
    save_strip(tmp_path / "strip.png", clip, moved, moments=3, size=(300, 100))
    picture = mediapy.read_image(tmp_path / "strip.png")
    assert picture.shape == (100, 300, 3)
    for third in np.split(picture, 3, axis=1):
        assert share_of(AGENT_COLOUR, third) > 0.02
    assert REFERENCE_COLOUR[3] == 1.0 > render.GHOST_ALPHA


def test_no_way_to_render_is_said_plainly(monkeypatch: pytest.MonkeyPatch) -> None:
    assert not render._backend_works("no such backend")
    monkeypatch.setattr(render, "can_render", lambda: False)
    with pytest.raises(RuntimeError, match="apt install"):
        render.SceneRenderer(64, 64, 45.0)
