"""What the studio draws: the bones of a skeleton, the figures of a clip in each frame."""

from pathlib import Path

import numpy as np
import pytest

from datasets.motion.rotation import rotate
from eval.studio.scene.clip_tracks import ClipTracks
from eval.studio.scene.skeleton_figure import rotations_from_z
from tests.eval.studio.studio_parts import FRAMES, workspace, write_clip


def test_bones_point_where_they_should() -> None:
    directions = np.array([[0.0, 0.0, 2.0], [0.0, 0.0, -3.0], [1.0, 0.0, 0.0], [0.0, -0.5, 0.0], [0.6, 0.0, 0.8]])
    up = np.broadcast_to((0.0, 0.0, 1.0), directions.shape)
    along = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    assert rotate(rotations_from_z(directions), up) == pytest.approx(along)


def test_tracks_of_a_clip(tmp_path: Path) -> None:
    clip = write_clip(tmp_path)
    with workspace(clip, tmp_path / "kept") as opened:
        project = opened.open(clip)
        before = ClipTracks(project.session, None)
        assert before.after is before.before
        assert before.footprints[0].shape == (0, 3)
        project.solver.wait()
        tracks = ClipTracks(project.session, project.result)
    assert tracks.centres.shape == (2, FRAMES, 3)
    assert tracks.centres[..., 2] == pytest.approx(np.full((2, FRAMES), 0.95), abs=0.15)  # of somebody who stands
    places, headings, feet = tracks.footprints
    assert feet.tolist() == [0, 1]  # both stand all the time
    assert places[0, 1] - places[1, 1] == pytest.approx(0.18, abs=0.03)  # hips are 0.18 m apart, the left one at the left
    assert headings == pytest.approx([0.0, 0.0], abs=0.1)
    head = project.session.performer.joint_map["head"]
    assert tracks.joints_after[0, head, 2] == pytest.approx(1.47, abs=0.1)  # legs of 0.83 m on ankles of 0.08 m, a trunk of 0.54 m
