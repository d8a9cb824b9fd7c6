"""Training of root models on a small scale: it learns, stops, resumes and says what is wrong."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from agents.root.model import RootModel
from agents.root.spec import RootSpec
from configs.errors import InputError
from configs.source_code import PROJECT_ROOT
from tests.trainers.run_comparison import final_state, same, stop_after
from tests.trainers.supervised.gliding_clip import gliding
from trainers.runs.checkpoint import Checkpoints
from trainers.supervised import cli as supervised
from trainers.supervised.root_config import RootConfig, RootDataConfig, RootLearnerConfig


@pytest.fixture
def tiny(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> RootConfig:
    """Return the config of a run of 60 batches on two gliding performers."""
    clips = [gliding("one", "ann", 1.0), gliding("two", "bob", 0.8, 150)]
    monkeypatch.setattr("trainers.supervised.tempo_takes.load_clips", lambda *_, **__: clips)
    source = tmp_path / "clips"
    source.mkdir()
    (source / "one.bvh").write_text("in its place come the clips above")
    return RootConfig(
        name="tiny",
        runs_dir=str(tmp_path / "runs"),
        data=RootDataConfig(motions=str(source), synthetic_sets=0, suit_takes=2),
        learner=RootLearnerConfig(batch=64, mask_share=0.5, learning_rate=3e-3, sequence=2),
        samples=60 * 64,
        evaluate_every=20,
        checkpoint_every=10,
    )


def test_a_run_leaves_its_files(tiny: RootConfig) -> None:
    folder = supervised.train(tiny, resume=False)
    assert (folder / "config.yaml").is_file()
    assert list(folder.glob("events.out.tfevents.*"))
    model, card = RootModel.load(folder / "best" / "model.safetensors")
    assert model.spec == RootSpec()
    assert card["held_out"] in ("ann", "bob")
    assert len(card["clips"]) == 1  # the other one's performer is held out
    assert str(Path(tiny.data.motions).parent) not in str(card)  # no path of this machine
    assert final_state(folder)["clock"]["samples"] == 60 * 64


def test_it_learns(tiny: RootConfig) -> None:
    # Accelerations of a gliding figure tell where it is on its sine, and so how fast it goes.
    folder = supervised.train(replace(tiny, samples=400 * 64, data=replace(tiny.data, holdout="none")), resume=False)
    score = RootModel.load(folder / "best" / "model.safetensors")[1]["held_out_metrics"]
    assert score["window_end_error_mm"] < 0.7 * 2 / np.pi * 80.0  # predicting no movement misses by the mean of |cos| of 80 mm


def test_resumed_equals_uninterrupted(tiny: RootConfig, monkeypatch: pytest.MonkeyPatch) -> None:
    whole = supervised.train(replace(tiny, name="whole"), resume=False)

    with monkeypatch.context() as patch:
        patch.setattr(supervised, "StopSignal", stop_after(30))
        parts = supervised.train(replace(tiny, name="parts"), resume=False)
    assert final_state(parts)["clock"]["iteration"] == 30
    supervised.train(replace(tiny, name="parts"), resume=True)
    same(final_state(whole), final_state(parts))


def test_a_run_of_an_earlier_version_goes_on(tiny: RootConfig) -> None:
    # Its config and its checkpoint know settings by the keys that they had then.
    folder = supervised.train(replace(tiny, samples=10 * 64), resume=False)
    checkpoints = Checkpoints(folder / "checkpoints", print)
    newest = checkpoints.newest()
    assert newest is not None
    tree, _ = newest
    then = {"data.synthetic_sets": "data.synthetic", "data.suit_takes": "data.takes", "data.pose_source": "data.poses"}
    assert then.keys() <= tree["made_of"].keys()
    tree["made_of"] = {then.get(name, name): value for name, value in tree["made_of"].items()}
    checkpoints.save(11, tree)
    checkpoints.raise_if_last_failed()
    supervised.train(replace(tiny, samples=20 * 64), resume=True)
    assert final_state(folder)["clock"]["samples"] == 20 * 64


def test_clips_that_are_too_short_are_one_line(tiny: RootConfig) -> None:
    with pytest.raises(InputError, match="no training clip is as long as 401 frames at 100 Hz"):
        supervised.train(replace(tiny, learner=replace(tiny.learner, batch=100, sequence=50)), resume=False)


def test_test_performers_are_never_seen(tiny: RootConfig) -> None:
    folder = supervised.train(replace(tiny, samples=64, data=replace(tiny.data, test_performers=("bob",), holdout="none")), resume=False)
    card = RootModel.load(folder / "best" / "model.safetensors")[1]
    assert card["performers"] == ["ann"]
    assert card["data"]["test_performers"] == ["bob"]


def test_a_network_with_batch_normalisation_goes_on(tiny: RootConfig) -> None:
    cnn = replace(
        tiny, model=RootSpec("planar_cnn", accelerations=False), learner=RootLearnerConfig(loss="mse", batch=16), samples=40 * 16,
        evaluate_every=40, checkpoint_every=20,
    )  # fmt: skip
    whole = supervised.train(replace(cnn, name="whole"), resume=False)
    supervised.train(replace(cnn, name="parts", samples=20 * 16, evaluate_every=20), resume=False)
    parts = supervised.train(replace(cnn, name="parts", evaluate_every=20), resume=True)
    same(final_state(whole)["learner"], final_state(parts)["learner"])


def test_an_earlier_run_is_kept(tiny: RootConfig) -> None:
    short = replace(tiny, samples=64)
    supervised.train(short, resume=False)
    folder = supervised.train(short, resume=False)
    assert (folder.parent / "tiny.1" / "best" / "model.safetensors").is_file()


def test_another_network_is_not_resumed(tiny: RootConfig) -> None:
    short = replace(tiny, samples=64)
    supervised.train(short, resume=False)
    with pytest.raises(InputError, match=r"trained with another model.accelerations; resume with"):
        supervised.train(replace(short, model=RootSpec(accelerations=False)), resume=True)
    with pytest.raises(InputError, match=r"trained with another data.suit_severity, learner.loss; resume with"):
        others = replace(short, data=replace(short.data, suit_severity=0.5), learner=replace(short.learner, loss="mse"))
        supervised.train(others, resume=True)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["learner.los=l1"], "unknown key 'learner.los', did you mean 'learner.loss'"),
        (["learner.loss=l3"], "learner.loss is 'l3', should be l1 or mse"),
        (["data.motions=nowhere"], "nowhere: no such file or folder"),
        (["data.synthetic_sets=0"], "holds no clip of at least 1 s"),
        (["--resume"], "there is no checkpoint to resume"),
        (["learner.batch=240"], "learner.sequence is 125, should be 1, or such that learner.batch (240) is a multiple of twice it"),
        (["runs_dir=/dev/null/runs"], "runs_dir: /dev/null/runs cannot be created"),
    ],
)
def test_bad_input_is_one_line(arguments: list[str], message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    config = str(PROJECT_ROOT / "configs" / "root3d.yaml")
    assert supervised.main(["--config", config, f"runs_dir={tmp_path}/runs", *arguments]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1
