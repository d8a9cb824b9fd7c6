"""Training of LoBSTr on a small scale: it learns legs that trackers tell, stops, resumes and says what is wrong."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from agents.lobstr.model import LobstrModel
from agents.lobstr.spec import LobstrSpec
from configs.errors import InputError
from configs.source_code import PROJECT_ROOT
from datasets.motion.clip import BodyMotion
from datasets.motion.humanoid import BODY_COUNT, BODY_NAMES
from datasets.motion.rotation import from_axis_angle
from tests.trainers.run_comparison import final_state, same
from trainers.supervised import cli as supervised
from trainers.supervised.lobstr_config import LobstrConfig, LobstrDataConfig, LobstrLearnerConfig

Y = np.array([0.0, 1.0, 0.0])


def bobbing(name: str, performer: str, frames: int = 400) -> BodyMotion:
    """Return somebody whose knees bend as he goes up and down: thigh, shin and foot by a, 2a and a, so that feet stay below hips."""
    a = 0.4 * (1.0 - np.cos(np.arange(frames) / 9.0))
    rotations = np.zeros((frames, BODY_COUNT, 4))
    rotations[..., 0] = 1.0
    for side in "lr":
        for body, turn in (("thigh", -a), ("shin", 2.0 * a), ("foot", -a)):
            rotations[:, BODY_NAMES.index(f"{body}_{side}")] = from_axis_angle(Y, turn)
    root = np.zeros((frames, 3))
    root[:, 2] = 0.11 + 0.83 * np.cos(a)
    return BodyMotion(root, rotations, 45.0, name, performer, "optical", "squat")


@pytest.fixture
def tiny(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> LobstrConfig:
    """Return the config of a run of 20 batches on two people who bob."""
    clips = [bobbing("one", "ann"), bobbing("two", "bob", 120)]
    monkeypatch.setattr("trainers.supervised.tempo_takes.load_clips", lambda *_, **__: clips)
    source = tmp_path / "clips"
    source.mkdir()
    (source / "one.bvh").write_text("in its place come the clips above")
    return LobstrConfig(
        name="tiny",
        runs_dir=str(tmp_path / "runs"),
        data=LobstrDataConfig(motions=str(source), tempo_takes=2, mirror=True),
        model=LobstrSpec(hidden=32, latent=16),
        learner=LobstrLearnerConfig(
            batch=16,
            predicted_frames=4,
            learning_rate=3e-3,
            final_learning_rate=3e-3,
            contact_weight=0.1,
            position_noise_m=0.0,
            rotation_noise_deg=0.0,
        ),
        samples=20 * 64,
        evaluate_every=10,
        checkpoint_every=10,
    )


def test_it_learns_how_far_knees_are_bent(tiny: LobstrConfig) -> None:
    folder = supervised.train(replace(tiny, samples=150 * 64), resume=False)
    model, card = LobstrModel.load(folder / "best" / "model.safetensors")
    assert model.spec == tiny.model
    assert len(card["clips"]) == 1  # as often as it was performed; the other one's performer is held out
    # The toes are 0.92 - 0.83 (1 - cos a) below the pelvis; a runs from 0 to 0.8, so that 0.13 m are the mean difference from the
    # mean of its values at most. The height of the pelvis tells all of it.
    assert card["held_out_metrics"]["toe_error_cm"] < 3.0
    assert card["held_out_metrics"]["contact_accuracy"] > 99.0  # his feet never leave the ground


def test_resumed_equals_uninterrupted(tiny: LobstrConfig) -> None:
    whole = supervised.train(replace(tiny, name="whole"), resume=False)
    # The rate falls with the progress of the whole: half of it is half the samples at the rate of the whole's beginning.
    steady = replace(tiny, name="parts", samples=10 * 64)
    supervised.train(steady, resume=False)
    parts = supervised.train(replace(tiny, name="parts"), resume=True)
    same(final_state(whole)["learner"], final_state(parts)["learner"])


def test_another_network_is_not_resumed(tiny: LobstrConfig) -> None:
    supervised.train(replace(tiny, samples=64), resume=False)
    with pytest.raises(InputError, match=r"trained with another model.inputs; resume with"):
        supervised.train(replace(tiny, model=replace(tiny.model, inputs="pose")), resume=True)


def test_clips_that_are_too_short_are_one_line(tiny: LobstrConfig) -> None:
    with pytest.raises(InputError, match="no training clip has 545 frames at 45 Hz"):
        supervised.train(replace(tiny, learner=replace(tiny.learner, predicted_frames=500)), resume=False)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["learner.predictd=2"], "unknown key 'learner.predictd', did you mean 'learner.predicted_frames'"),
        (["learner.predicted_frames=1"], "learner.predicted_frames is 1, should be 2 or more"),
        (["model.encoder=transformer"], "model.encoder is 'transformer', should be one of gru"),
        (["learns=root"], "learns is 'root', should be lower_body"),
        (["data.motions=nowhere"], "nowhere: no such file or folder"),
    ],
)
def test_bad_input_is_one_line(arguments: list[str], message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    config = str(PROJECT_ROOT / "configs" / "lobstr.yaml")
    assert supervised.main(["--config", config, f"runs_dir={tmp_path}/runs", *arguments]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1
