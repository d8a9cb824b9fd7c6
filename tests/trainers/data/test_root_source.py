"""Choice of the clips' roots: recorded or reconstructed."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from agents.root.model import RootModel
from agents.root.spec import RootSpec
from agents.weights import pretrained
from datasets.imu.suit_simulation import simulate_suit
from datasets.library.sources import SourceMotion
from datasets.motion.kinematics import body_poses, lowest_point_heights
from tests.builders import lively, posed
from trainers.data.root_source import RootSource, faulty_clip


@pytest.fixture
def still_models(monkeypatch: pytest.MonkeyPatch) -> None:
    """Put models in the package's place that say nobody ever moves."""

    def model(name: str) -> RootModel:
        built = RootModel(RootSpec(accelerations=name == "root3d")).eval()
        head = built.network.unet.head
        head.weight.data.zero_()
        head.bias.data.zero_()
        return built

    monkeypatch.setattr(pretrained, "load_pretrained_root", model)


@pytest.mark.usefixtures("still_models")
def test_clips_of_suits_and_clips_without_a_root_get_one() -> None:
    said: list[str] = []
    optical, suit = replace(lively(), name="optical", system="optical"), replace(lively(), name="suit", system="imu")
    rootless = replace(lively(1), name="rootless", system="optical", rooted=False)
    rooted, by = RootSource(True, said.append).apply_to_recordings([SourceMotion(optical), SourceMotion(suit), SourceMotion(rootless)])
    assert rooted[0] is optical
    assert by == {"suit": "root3d_pose", "rootless": "root3d_pose"}
    # Lively flies forward at 4 m/s; what stands for the models says that the root stays.
    assert np.ptp(rooted[1].root_position[:, 0]) < 0.5 < np.ptp(suit.root_position[:, 0])
    assert said == ["2 clips of IMU suits or without a root get theirs from root3d_pose: rootless, suit"]


def test_recorded_roots_are_kept() -> None:
    suit = replace(lively(), system="imu")
    rooted, by = RootSource(False, pytest.fail).apply_to_recordings([SourceMotion(suit)])
    assert rooted[0] is suit
    assert not by


@pytest.mark.usefixtures("still_models")
def test_a_file_with_accelerations_gets_its_root_by_them() -> None:
    suit = replace(lively(), name="suit", system="imu")
    said: list[str] = []
    _, by = RootSource(True, said.append).apply_to_recordings(
        [SourceMotion(suit, np.zeros((199, 19, 3)))]
    )  # 120 frames at 60 are 199 at 100 fps
    assert by == {"suit": "root3d"}
    assert said == ["1 clips of IMU suits or without a root get theirs from root3d: suit"]


@pytest.mark.usefixtures("still_models")
def test_a_simulated_suit_begins_where_its_truth_begins_with_its_feet_on_the_ground() -> None:
    bent = posed({"shin_l_y": 10.0}, frames=120)
    clean = replace(bent, root_position=bent.root_position + np.array([3.0, 2.0, 0.0]))
    recording = simulate_suit(clean, seed=0, severity=0.0)
    clip = faulty_clip(recording, restored=False, reconstructed=True)
    np.testing.assert_allclose(clip.root_position[0, :2], [3.0, 2.0], atol=1e-6)
    assert abs(lowest_point_heights(*body_poses(clip)).min()) < 0.01
    assert faulty_clip(recording, restored=False, reconstructed=False) is recording.faulty


def test_a_suit_s_poses_are_restored_before_its_root_is_read_from_them(monkeypatch: pytest.MonkeyPatch) -> None:
    suit = simulate_suit(posed({}, frames=120), seed=0, severity=0.0)
    straight = posed({"shin_l_y": 20.0}, frames=120)
    monkeypatch.setattr(
        "trainers.data.root_source.restore_suit_poses",
        lambda clip: SimpleNamespace(motion=replace(clip, local_rotations=straight.local_rotations)),
    )
    own = faulty_clip(suit, restored=True, reconstructed=False)
    assert np.array_equal(own.local_rotations, straight.local_rotations)
    assert np.array_equal(own.root_position, suit.faulty.root_position)
    assert np.array_equal(faulty_clip(suit, restored=True, reconstructed=True).local_rotations, straight.local_rotations)
