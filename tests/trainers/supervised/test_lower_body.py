"""Training of a lower-body network on a small scale: it learns legs that trackers tell, resumes, and says what is wrong."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
import torch

from agents.lower_body.model import LowerBodyModel, LowerBodyPrediction
from agents.lower_body.spec import LowerBodySpec
from configs.source_code import PROJECT_ROOT
from datasets.trackers.joint_features import JointPoses
from datasets.trackers.trackers import ALL_TRACKER_NAMES, FOOT_TRACKERS, HEAD_TRACKER, PELVIS_TRACKER, SHIN_TRACKERS
from tests.trainers.run_comparison import final_state, same
from tests.trainers.supervised.test_lobstr import bobbing
from trainers.supervised import cli as supervised
from trainers.supervised.lobstr_config import LobstrDataConfig
from trainers.supervised.lower_body_augmentation import TrackerAugmentation
from trainers.supervised.lower_body_config import LowerBodyConfig, LowerBodyLearnerConfig
from trainers.supervised.lower_body_data import prepare_lower_body_data
from trainers.supervised.lower_body_learner import LowerBodyLearner

EXACT = LowerBodyLearnerConfig(
    batch=8, frames=60, skipped_frames=5, learning_rate=5e-3, final_learning_rate=5e-3, average=0.9, users=4, perfect_share=1.0,
    convention_deg=0.0, build=0.0, floor_m=0.0, position_noise_m=0.0, rotation_noise_deg=0.0, no_pelvis_share=0.0, feet_share=0.0,
    shins_share=0.0, lost_share=0.0,
)  # fmt: skip


@pytest.fixture
def tiny(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> LowerBodyConfig:
    """Return the config of a run of 20 batches on two people who bob."""
    clips = [bobbing("one", "ann"), bobbing("two", "bob", 120)]
    monkeypatch.setattr("trainers.supervised.tempo_takes.load_clips", lambda *_, **__: clips)
    source = tmp_path / "clips"
    source.mkdir()
    (source / "one.bvh").write_text("in its place come the clips above")
    return LowerBodyConfig(
        name="tiny",
        runs_dir=str(tmp_path / "runs"),
        data=LobstrDataConfig(motions=str(source), tempo_takes=1),
        model=LowerBodySpec(hidden=24, layers=1, dropout=0.0),
        learner=EXACT,
        samples=20 * 480,
        evaluate_every=10,
        checkpoint_every=10,
    )


def test_it_learns_how_far_knees_are_bent(tiny: LowerBodyConfig) -> None:
    folder = supervised.train(replace(tiny, samples=60 * 480), resume=False)
    model, card = LowerBodyModel.load(folder / "best" / "model.safetensors")
    assert model.spec == tiny.model
    # His toes rise and fall by 0.5 m against the pelvis, 0.13 m from their mean on average; the pelvis' height tells all of it.
    assert card["held_out_metrics"]["toe_error_cm"] < 3.0
    assert card["held_out_metrics"]["contact_accuracy"] > 99.0  # his feet never leave the ground


def test_resumed_equals_uninterrupted(tiny: LowerBodyConfig) -> None:
    whole = supervised.train(replace(tiny, name="whole", learner=LowerBodyLearnerConfig(**_steady())), resume=False)
    parts = replace(tiny, name="parts", learner=LowerBodyLearnerConfig(**_steady()))
    supervised.train(replace(parts, samples=10 * 480), resume=False)
    supervised.train(parts, resume=True)
    same(final_state(whole)["learner"], final_state(Path(parts.runs_dir) / "parts")["learner"])


def _steady() -> dict[str, Any]:
    """Return learner settings with everything random in it, at one learning rate from the second batch on."""
    return {"batch": 8, "frames": 60, "skipped_frames": 5, "learning_rate": 1e-3, "final_learning_rate": 1e-3, "users": 4}


def test_the_truth_has_no_loss_but_the_feet_that_slide(tiny: LowerBodyConfig, tmp_path: Path) -> None:
    data = prepare_lower_body_data(tiny.data, tmp_path / "cache", lambda _: None)
    learner = LowerBodyLearner(tiny, data)
    pieces = learner._draw(4)
    seen = torch.ones(4, 60, len(ALL_TRACKER_NAMES), dtype=torch.bool)
    seen[2:, :, PELVIS_TRACKER] = False  # the head's heading and place are the reference

    class Oracle(torch.nn.Module):
        """Says the truth about people who face x, whose head is over the pelvis and who never turn."""

        def forward(self, features: torch.Tensor, masks: torch.Tensor) -> LowerBodyPrediction:
            pelvis = pieces.positions[:, :, PELVIS_TRACKER] * torch.tensor([0.0, 0.0, 1.0])
            rotations = torch.cat([torch.eye(3).expand(4, 60, 1, 3, 3), pieces.legs], 2)
            return LowerBodyPrediction(rotations, pelvis, 40.0 * (pieces.contacts - 0.5))

    with torch.inference_mode():
        found = learner._losses(Oracle(), pieces, JointPoses(pieces.positions, pieces.rotations, seen, seen))
    assert float(found["toe_error_cm"]) < 1e-3
    assert float(found["rotation_error_deg"]) < 0.1
    assert float(found["contact_accuracy"]) == 100.0
    # The thigh is 0.01 m longer than the shin, so that feet slide by 0.01 sin a; a changes by 0.4 / 9 a frame at most: 2 cm/s.
    assert 0.5 < float(found["stance_cm_s"]) < 2.0


def test_padded_frames_are_no_frames(tiny: LowerBodyConfig, tmp_path: Path) -> None:
    data = prepare_lower_body_data(replace(tiny.data), tmp_path / "cache", lambda _: None)
    learner = LowerBodyLearner(replace(tiny, learner=replace(EXACT, frames=200)), data)
    pieces = learner._cut(torch.tensor([400]), torch.tensor([120]))  # the second clip, all of its 120 frames
    assert pieces.inside.sum() == 120
    assert torch.equal(pieces.positions[0, 119], pieces.positions[0, 199])


def test_trackers_are_lost_as_often_as_told_and_one_reference_stays() -> None:
    config = replace(EXACT, no_pelvis_share=0.5, feet_share=0.25, shins_share=0.6, imu_share=0.5, lost_share=0.3)
    augment = TrackerAugmentation(config, 0, torch.Generator().manual_seed(0))
    positions, rotations = torch.zeros(400, 60, 8, 3), torch.eye(3).expand(400, 60, 8, 3, 3)
    seen, oriented = augment(positions, rotations)[2:]
    assert bool(torch.logical_or(seen[..., HEAD_TRACKER], seen[..., PELVIS_TRACKER]).all())
    assert float(seen[..., PELVIS_TRACKER].any(1).float().mean()) == pytest.approx(0.5, abs=0.1)
    assert float(oriented[..., FOOT_TRACKERS].any(1).float().mean()) == pytest.approx(0.25, abs=0.08)
    assert float(oriented[..., SHIN_TRACKERS].any(1).float().mean()) == pytest.approx(0.6, abs=0.08)
    assert float(seen[..., SHIN_TRACKERS].any(1).float().mean()) == pytest.approx(0.3, abs=0.08)  # the others are IMUs
    assert bool(torch.logical_or(oriented, torch.logical_not(seen)).all())


def test_worn_trackers_deviate_by_a_constant_of_each_piece() -> None:
    augment = TrackerAugmentation(replace(EXACT, perfect_share=0.0, convention_deg=3.0), 0, torch.Generator().manual_seed(0))
    positions, rotations = torch.randn(50, 7, 8, 3), torch.eye(3).expand(50, 7, 8, 3, 3)
    worn = augment(positions, rotations)
    assert torch.allclose(worn.rotations, worn.rotations[:, :1].expand_as(worn.rotations), atol=1e-6)
    assert float((worn.rotations - torch.eye(3)).abs().amax((1, 2, 3, 4)).min()) > 0.0  # nobody's are exact
    assert float((worn.positions - positions).norm(dim=-1).mean()) < 0.08
    exact = TrackerAugmentation(EXACT, 0, torch.Generator().manual_seed(0))(positions, rotations)
    assert torch.allclose(exact.positions, positions, atol=1e-6)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["learner.frame=2"], "unknown key 'learner.frame', did you mean 'learner.frames'"),
        (["learner.frames=1"], "learner.frames is 1, should be 2 or more"),
        (["learner.lost_share=2"], "learner.lost_share is 2.0, should be from 0 to 1"),
        (["learns=root"], "learns is 'root', should be legs"),
    ],
)
def test_bad_input_is_one_line(arguments: list[str], message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    config = str(PROJECT_ROOT / "configs" / "lower_body.yaml")
    assert supervised.main(["--config", config, f"runs_dir={tmp_path}/runs", *arguments]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1
