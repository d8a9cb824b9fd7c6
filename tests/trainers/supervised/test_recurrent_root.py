"""The learner of the recurrent root model: its loss and its mirrored sequences by hand, and that it learns."""

from dataclasses import replace
from pathlib import Path

import pytest
import torch

from agents.root.model import RootModel
from agents.root.spec import RootSpec
from configs.errors import InputError
from datasets.imu.sensor_model import SENSOR_BODIES
from datasets.motion.humanoid import BODY_COUNT, BODY_NAMES
from tests.trainers.run_comparison import final_state, same, stop_after
from tests.trainers.supervised.gliding_clip import gliding
from trainers.supervised import cli as supervised
from trainers.supervised.recurrent_root_learner import MIN_DISTANCE_M, Sequences, _mirrored, path_loss
from trainers.supervised.root_config import RootConfig, RootDataConfig, RootLearnerConfig


def test_the_loss_sums_distances_over_horizons() -> None:
    # 5 mm too far in each of 30 patches: 5, 25, 125 mm over 1, 5, 25 patches and 150 mm in all; over the root of 0.04, 0.2, 1.0, 1.2 s.
    errors = torch.tensor([0.003, 0.004, 0.0]).expand(2, 30, 3)
    by_hand = 0.005 / 0.04**0.5 + 0.025 / 0.2**0.5 + 0.125 + 0.150 / 1.2**0.5
    assert float(path_loss(errors)) == pytest.approx(by_hand, rel=1e-2)  # distances of millimetres are smooth at zero
    assert float(path_loss(torch.zeros(1, 3, 3))) == pytest.approx(MIN_DISTANCE_M * (1 / 0.04**0.5 + 1 / 0.12**0.5), rel=1e-4)


def test_errors_that_cancel_count_in_short_horizons_alone() -> None:
    errors = torch.tensor([[0.1, 0.0, 0.0], [-0.1, 0.0, 0.0]])[None]  # the whole sequence is two patches long, and right
    assert float(path_loss(errors)) == pytest.approx(0.1 / 0.04**0.5, rel=0.02)


def test_the_first_half_is_mirrored() -> None:
    hands = [BODY_NAMES.index("hand_l"), BODY_NAMES.index("hand_r")]
    joints, felt = torch.zeros(2, 1, 8, BODY_COUNT, 3), torch.zeros(2, 1, 8, len(SENSOR_BODIES), 3)
    joints[:, :, :, hands[0]] = torch.tensor([1.0, 2.0, 3.0])
    felt[:, :, :, SENSOR_BODIES.index(hands[1])] = torch.tensor([4.0, 5.0, 6.0])
    along = torch.tensor([1.0, 2.0, 3.0])
    sequences = Sequences(joints, felt, along.expand(2, 1, 3), along.expand(2, 1, 5, 3), torch.full((2, 1), 0.3), along.expand(2, 1, 3))
    mirrored = _mirrored(sequences)
    assert mirrored.joints[0, 0, 0, hands[1]].tolist() == [1.0, -2.0, 3.0]
    assert mirrored.joints[0, 0, 0, hands[0]].tolist() == [0.0, 0.0, 0.0]
    assert mirrored.accelerations is not None
    assert mirrored.accelerations[0, 0, 0, SENSOR_BODIES.index(hands[0])].tolist() == [4.0, -5.0, 6.0]
    assert [part[0].reshape(-1, 3)[0].tolist() for part in (mirrored.felt, mirrored.centre, mirrored.moved)] == [[1.0, -2.0, 3.0]] * 3
    assert mirrored.heading.flatten().tolist() == pytest.approx([-0.3, 0.3])
    for name in Sequences._fields:
        assert torch.equal(getattr(mirrored, name)[1], getattr(sequences, name)[1])


@pytest.fixture
def tiny(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> RootConfig:
    """Return the config of a run of 40 batches on two gliding performers."""
    clips = [gliding("one", "ann", 1.0), gliding("two", "bob", 0.8)]
    monkeypatch.setattr("trainers.supervised.tempo_takes.load_clips", lambda *_, **__: clips)
    source = tmp_path / "clips"
    source.mkdir()
    (source / "one.bvh").write_text("in its place come the clips above")
    return RootConfig(
        name="tiny",
        runs_dir=str(tmp_path / "runs"),
        data=RootDataConfig(motions=str(source), synthetic_sets=0, suit_takes=1, suit_severity=0.2),
        model=RootSpec("gru"),
        learner=RootLearnerConfig(batch=200, mask_share=0.5, learning_rate=3e-3, sequence=25),
        samples=40 * 200,
        evaluate_every=20,
        checkpoint_every=10,
    )


def test_it_learns(tiny: RootConfig) -> None:
    best = supervised.train(replace(tiny, samples=200 * 200), resume=False) / "best" / "model.safetensors"
    trained, begun = RootModel.load(best)[1]["held_out_metrics"]["loss"], 0.91  # what it says after 20 batches
    assert trained < 0.7 * begun


def test_a_resumed_run_equals_an_uninterrupted_one(tiny: RootConfig, monkeypatch: pytest.MonkeyPatch) -> None:
    whole = final_state(supervised.train(tiny, resume=False))
    stopped = replace(tiny, name="stopped")
    with monkeypatch.context() as patch:
        patch.setattr(supervised, "StopSignal", stop_after(15))
        supervised.train(stopped, resume=False)
    same(final_state(supervised.train(stopped, resume=True))["learner"], whole["learner"])


def test_clips_shorter_than_a_sequence_are_one_line(tiny: RootConfig) -> None:
    long = replace(tiny, learner=replace(tiny.learner, batch=4000, sequence=100))  # 99 x 4 + 8 frames
    with pytest.raises(InputError, match="no training clip is as long as 405 frames at 100 Hz"):
        supervised.train(long, resume=False)
