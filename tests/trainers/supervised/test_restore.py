"""Training of a restoring network on a small scale, and the augmentation that tells faults from conventions."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from agents.restore.kinematics import joint_positions
from agents.restore.model import RestoreModel
from agents.restore.spec import PATCH_FRAMES, RestoreSpec
from configs.errors import InputError
from configs.source_code import PROJECT_ROOT
from datasets.imu.suit_simulation import SuitClip
from datasets.motion.clip import FPS, BodyMotion
from datasets.motion.humanoid import BODY_COUNT, BODY_NAMES
from datasets.motion.mirror import mirror_motion
from datasets.motion.rotation import conjugate, from_rotation_vector, from_yaw, multiply, to_rotation_vector
from tests.agents.restore.test_restore import pitched
from tests.builders import STANDING, lively, posed
from tests.trainers.run_comparison import final_state, same
from trainers.supervised import cli as supervised
from trainers.supervised.restore_augmentation import augment_windows, symmetric_misalignment
from trainers.supervised.restore_config import RestoreConfig, RestoreDataConfig, RestoreLearnerConfig
from trainers.supervised.restore_data import RestoreFrames, restore_frames

PLAIN = RestoreLearnerConfig(clean_share=0.0, added_misalignment=0.0, convention=0.0, mirror=False, exchange_share=0.0, sway=0.0)
CHEST, THIGH, FOOT_L, FOOT_R = (BODY_NAMES.index(name) for name in ("chest", "thigh_l", "foot_l", "foot_r"))
UPPER_ARM, FOREARM = BODY_NAMES.index("upper_arm_l"), BODY_NAMES.index("forearm_l")
TRUNKS_CHANGE_PLACES = 0  # seed with which two windows exchange their trunks
NUM_UPDATES = 10


@pytest.fixture
def tiny(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> RestoreConfig:
    """Return the config of a short run on two people whose suit has the chest's sensor pitched by 0.3 rad."""
    clips = [replace(lively(seed, 0, 200), name=name, performer=name, system="optical") for seed, name in enumerate(("ann", "bob"))]
    monkeypatch.setattr("trainers.supervised.tempo_takes.load_clips", lambda *_, **__: clips)
    monkeypatch.setattr(
        "trainers.supervised.restore_data.simulate_suit", lambda clean, *_: SuitClip(pitched(clean, 0.3), np.zeros((1, 19, 3)), clean)
    )
    source = tmp_path / "clips"
    source.mkdir()
    (source / "one.bvh").write_text("in its place come the clips above")
    return RestoreConfig(
        name="tiny",
        runs_dir=str(tmp_path / "runs"),
        data=RestoreDataConfig(motions=str(source), suit_takes=2),
        model=RestoreSpec(window=40, channels=16, dilations=(1, 2), pooled_blocks=(1,)),
        learner=replace(PLAIN, batch=4, learning_rate=3e-3, final_learning_rate=3e-3),
        samples=NUM_UPDATES * 4,
        evaluate_every=5,
        checkpoint_every=5,
    )


def test_it_learns_a_misalignment_that_everybody_has(tiny: RestoreConfig) -> None:
    folder = supervised.train(replace(tiny, samples=150 * 4, evaluate_every=50), resume=False)
    model, card = RestoreModel.load(folder / "best" / "model.safetensors")
    assert model.spec == tiny.model
    assert card["performers"] == ["ann"] or card["performers"] == ["bob"]
    held_out = card["held_out_metrics"]
    assert held_out["before_mm"] > 20.0  # 0.27 m from chest to head, times 0.3, over half of the bodies
    assert held_out["restored_error_mm"] < 0.4 * held_out["before_mm"]


def test_resumed_equals_uninterrupted(tiny: RestoreConfig) -> None:
    whole = supervised.train(replace(tiny, name="whole"), resume=False)
    # The rate is constant, but for the first update, whatever the length of the training.
    half = replace(tiny, name="parts", samples=5 * 4)
    supervised.train(half, resume=False)
    parts = supervised.train(replace(half, samples=tiny.samples), resume=True)
    same(final_state(whole)["learner"], final_state(parts)["learner"])


def test_clips_that_are_too_short_are_one_line(tiny: RestoreConfig) -> None:
    long = replace(tiny, model=replace(tiny.model, window=400), learner=replace(tiny.learner, shortest_s=12.0))
    with pytest.raises(InputError, match=r"no training clip lasts 12 s; take longer clips or a smaller learner\.shortest_s"):
        supervised.train(long, resume=False)


def test_frames_of_a_standing_figure_say_that_it_stands() -> None:
    stands = replace(posed({}, 60), name="stands")
    frames = restore_frames(stands, stands)
    assert len(frames.truth) == 30
    assert np.array_equal(frames.contacts, np.ones((30, 6)))  # both feet, and heel and toe of both
    assert np.allclose(frames.root, [STANDING, 0.0, 0.0], atol=1e-6)


def test_velocity_is_told_in_the_pelvis_heading() -> None:
    local = posed({}, 60).local_rotations.copy()
    local[:, 0] = np.cos(np.pi / 4), 0.0, 0.0, np.sin(np.pi / 4)  # faces y
    root = np.zeros((60, 3))
    root[:, 1] = np.arange(60) / FPS  # walks along y at 1 m/s
    walks = BodyMotion(root, local, FPS, "walks")
    assert np.allclose(restore_frames(walks, walks).root[:, 1:], [1.0, 0.0], atol=1e-6)


def windows(clips: list[BodyMotion]) -> RestoreFrames:
    """Return clips as windows, each with a chest that is pitched by 0.2 rad."""
    frames = [restore_frames(pitched(clip, 0.2), clip) for clip in clips]
    return RestoreFrames(*(torch.from_numpy(np.stack(parts)) for parts in zip(*frames, strict=True)))


def test_without_augmentation_windows_stay() -> None:
    same_clip = windows([lively(0, 0, 80)])
    found = augment_windows(PLAIN, same_clip, torch.Generator())
    assert torch.allclose((found.captured * same_clip.captured).sum(-1).abs(), torch.ones(1, 40, BODY_COUNT), atol=1e-5)
    assert torch.allclose((found.truth * same_clip.truth[:, ::PATCH_FRAMES]).sum(-1).abs(), torch.ones(1, 20, BODY_COUNT), atol=1e-5)


def test_a_mirrored_window_is_that_of_the_mirrored_clip() -> None:
    clip = lively(0, 0, 80)
    found = augment_windows(replace(PLAIN, mirror=True), windows([clip, clip]), torch.Generator())
    mirrored = windows([mirror_motion(clip)])
    assert torch.allclose(joint_positions(found.captured)[0], joint_positions(mirrored.captured)[0], atol=1e-5)
    assert torch.equal(found.contacts[0], mirrored.contacts[0])
    assert torch.allclose(found.root[0], mirrored.root[0], atol=1e-5)


def test_an_exchanged_trunk_faces_where_the_pelvis_does() -> None:
    walks = windows([lively(0, 0, 80), lively(1, 0, 80)])
    turn = from_yaw(np.array(1.0, dtype=np.float32))
    turned = torch.from_numpy(turn).expand(walks.truth[1].shape)
    walks.truth[1], walks.captured[1] = multiply(turned, walks.truth[1]), multiply(turned, walks.captured[1])
    random = torch.Generator().manual_seed(TRUNKS_CHANGE_PLACES)
    found = augment_windows(replace(PLAIN, exchange_share=1.0), walks, random)
    own, other = windows([lively(0, 0, 80), lively(1, 0, 80)]).captured
    assert torch.allclose((found.captured[0, :, FOOT_L] * own[:, FOOT_L]).sum(-1).abs(), torch.ones(40), atol=1e-5)
    # ``lively`` turns at the same rate whatever its seed, so the other's chest is turned back by the 1 rad that it was turned by.
    assert torch.allclose((found.captured[0, :, CHEST] * other[:, CHEST]).sum(-1).abs(), torch.ones(40), atol=1e-5)


def test_sway_moves_the_upper_body_of_both_clips_and_leaves_legs_faults_and_elbows() -> None:
    before = windows([lively(0, 0, 80)])
    found = augment_windows(replace(PLAIN, sway=0.5), before, torch.Generator().manual_seed(0))
    moved = 1.0 - (found.captured * before.captured).sum(-1).abs()
    assert moved[:, :, [0, THIGH, FOOT_L, FOOT_R]].max() < 1e-6
    assert moved[:, :, CHEST].mean() > 1e-4
    assert found.captured.diff(dim=1).abs().max() < 2.0 * before.captured.diff(dim=1).abs().max()  # slowly
    fault = multiply(conjugate(found.truth), found.captured[:, ::PATCH_FRAMES])
    fault_before = multiply(conjugate(before.truth), before.captured)[:, ::PATCH_FRAMES]
    assert torch.allclose((fault * fault_before).sum(-1).abs(), torch.ones(1, 20, BODY_COUNT), atol=1e-5)
    elbow, elbow_before = (multiply(conjugate(one.captured[:, :, UPPER_ARM]), one.captured[:, :, FOREARM]) for one in (found, before))
    assert torch.allclose((elbow * elbow_before).sum(-1).abs(), torch.ones(1, 40), atol=1e-5)


def test_a_clean_window_shows_the_truth() -> None:
    found = augment_windows(replace(PLAIN, clean_share=0.999999), windows([lively(0, 0, 80)]), torch.Generator())
    assert torch.allclose((found.captured[:, ::PATCH_FRAMES] * found.truth).sum(-1).abs(), torch.ones(1, 20, BODY_COUNT), atol=1e-5)


def test_added_misalignments_are_constant_and_the_captured_clip_s_alone() -> None:
    clip = windows([lively(0, 0, 80)])
    found = augment_windows(replace(PLAIN, added_misalignment=0.2), clip, torch.Generator().manual_seed(1))
    assert torch.allclose((found.truth * clip.truth[:, ::PATCH_FRAMES]).sum(-1).abs(), torch.ones(1, 20, BODY_COUNT), atol=1e-5)
    added = to_rotation_vector(multiply(conjugate(clip.captured), found.captured))[0, :, THIGH]
    assert added[0].norm() > 0.01
    assert torch.allclose(added, added[:1].expand(added.shape), atol=1e-4)


def test_a_convention_is_the_same_on_both_sides_and_on_both_clips() -> None:
    clip = windows([lively(0, 0, 80)])
    found = augment_windows(replace(PLAIN, convention=0.3), clip, torch.Generator().manual_seed(1))
    steps = slice(None, None, PATCH_FRAMES)
    captured, truth = (
        to_rotation_vector(multiply(conjugate(before[:, steps]), after))[0, 0]
        for before, after in ((clip.captured, found.captured[:, steps]), (clip.truth, found.truth))
    )
    assert torch.allclose(captured[FOOT_L], truth[FOOT_L], atol=1e-4)
    assert truth[FOOT_L].norm() > 0.01
    assert torch.allclose(truth[FOOT_R], truth[FOOT_L] * torch.tensor([-1.0, 1.0, -1.0]), atol=1e-4)
    assert torch.allclose(truth[CHEST][[0, 2]], torch.zeros(2), atol=1e-4)


def test_a_symmetric_misalignment_makes_a_symmetric_t_pose() -> None:
    vectors = symmetric_misalignment(torch.randn(BODY_COUNT, 3, generator=torch.Generator().manual_seed(0)))
    joints = joint_positions(from_rotation_vector(vectors)[None])[0]
    left, right = ([BODY_NAMES.index(f"{body}_{side}") for body in ("hand", "forearm", "foot", "toe")] for side in "lr")
    assert torch.allclose(joints[left] * torch.tensor([1.0, -1.0, 1.0]), joints[right], atol=1e-5)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["learner.clean_share=1"], "learner.clean_share is 1.0, should be from 0 up to but not 1"),
        (["data.max_severity=0.1"], "data.max_severity is 0.1, should be data.min_severity or more"),
        (["learns=root"], "learns is 'root', should be restore"),
        (["data.motions=nowhere"], "nowhere: no such file or folder"),
    ],
)
def test_bad_input_is_one_line(arguments: list[str], message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    config = str(PROJECT_ROOT / "configs" / "restore.yaml")
    assert supervised.main(["--config", config, f"runs_dir={tmp_path}/runs", *arguments]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1
