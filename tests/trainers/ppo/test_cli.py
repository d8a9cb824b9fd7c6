"""The main job on a small scale: it trains, stops, resumes and says what is wrong."""

import os
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from agents.policy.policy import Policy
from configs.errors import InputError
from configs.source_code import PROJECT_ROOT
from datasets.library.motion_library import MotionLibrary
from datasets.library.sources import SourceMotion
from tests.trainers.conftest import standing
from tests.trainers.run_comparison import final_state, same, whole_and_in_parts
from trainers.algorithms.ppo_config import CollectConfig, PpoConfig
from trainers.algorithms.ppo_learner import PpoLearner
from trainers.collectors.cpu_collector import CpuCollector
from trainers.ppo import cli as ppo


def test_a_run_leaves_its_files(tiny: PpoConfig) -> None:
    folder = ppo.train(tiny, resume=False)
    assert (folder / "config.yaml").is_file()
    assert list(folder.glob("events.out.tfevents.*"))
    policy, card = Policy.load(folder / "best" / "policy.safetensors")
    assert policy.act(np.zeros((5, 273), np.float32)).shape == (5, 20)
    assert card["clips"] != ["one", "two"]  # one performer is held out
    assert card["machine"].startswith("physics=cpu, learner on ")
    assert final_state(folder)["clock"]["samples"] == 6 * 32


def test_resumed_equals_uninterrupted(tiny: PpoConfig, monkeypatch: pytest.MonkeyPatch) -> None:
    whole, parts = whole_and_in_parts(tiny, monkeypatch)
    same(final_state(whole), final_state(parts))
    best = [Policy.load(folder / "best" / "policy.safetensors")[0].state_dict() for folder in (whole, parts)]
    same({name: tensor.numpy() for name, tensor in best[0].items()}, {name: tensor.numpy() for name, tensor in best[1].items()})


def test_other_motion_is_not_resumed(tiny: PpoConfig, monkeypatch: pytest.MonkeyPatch) -> None:
    ppo.train(tiny, resume=False)
    others = [standing("one", "ann", 300), standing("two", "bob", 130)]
    monkeypatch.setattr("trainers.data.training_motions.load_source_motions", lambda *_, **__: [SourceMotion(clip) for clip in others])
    with pytest.raises(InputError, match="trained on other motion"):
        ppo.train(replace(tiny, data=replace(tiny.data, seed=1)), resume=True)


def test_a_run_begins_with_the_policy_of_a_file(tiny: PpoConfig, monkeypatch: pytest.MonkeyPatch) -> None:
    first = ppo.train(tiny, resume=False) / "best" / "policy.safetensors"
    policy, card = Policy.load(first)
    policy.save(first, card | {"clips": ["elsewhere"], "performers": ["eve"], "samples": 7})
    with monkeypatch.context() as patch:
        patch.setattr(ppo.StopSignal, "is_requested", True)  # before the first iteration
        begun = final_state(ppo.train(replace(tiny, name="second", init=str(first)), resume=False))
    same({name: tensor.numpy() for name, tensor in policy.state_dict().items()}, begun["learner"]["network"])
    assert begun["clock"]["samples"] == 0
    # Whatever the first policy was trained on the second one's card names as well.
    folder = ppo.train(replace(tiny, name="second", init=str(first)), resume=False)
    _, now = Policy.load(folder / "best" / "policy.safetensors")
    assert {"elsewhere", "eve"} < {*now["clips"], *now["performers"]}
    assert now["begun_from"]["samples"] == 7


def test_a_policy_of_another_task_or_network_is_no_beginning(tiny: PpoConfig) -> None:
    first = ppo.train(tiny, resume=False) / "best" / "policy.safetensors"
    other_task = replace(tiny, task=replace(tiny.task, smoothing=0.5), init=str(first))
    with pytest.raises(InputError, match=r"init=.*policy\.safetensors was trained with task\.smoothing=0\.2, this run has 0\.5"):
        ppo.train(other_task, resume=False)
    with pytest.raises(InputError, match=r"trained with network\.hidden=\[16\], this run has \[8\]"):
        ppo.train(replace(tiny, network=replace(tiny.network, hidden=(8,)), init=str(first)), resume=False)
    # What a bad habit costs changes what is learnt, not what is seen or done.
    ppo.train(replace(tiny, name="priced", task=replace(tiny.task, foot_slip=0.5), init=str(first)), resume=False)
    with pytest.raises(InputError, match="there is no policy at nowhere"):
        ppo.train(replace(tiny, init="nowhere"), resume=False)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
@pytest.mark.parametrize("actors", [0, 1])
@pytest.mark.slow
def test_a_signal_and_resume(number: signal.Signals, actors: int, tmp_path: Path) -> None:
    run = [sys.executable, "-m", "trainers.ppo", "--config", "configs/mixed.yaml"]
    small = ["collect.envs=4", "collect.horizon=4", "network.hidden=[8]", "samples=1000000", "checkpoint_every=1"]
    # On motion that is not the config's default seed: --resume must find it in the run's own config.
    settings = [f"runs_dir={tmp_path}", f"collect.actors={actors}", "data.suit_clips=0", "data.seed=3", *small]
    root = PROJECT_ROOT
    with subprocess.Popen([*run, *settings], cwd=root, start_new_session=True, stdout=subprocess.PIPE, text=True) as process:
        for _ in range(1200):
            if list((tmp_path / "mixed").glob("checkpoints/*.safetensors")):
                break
            time.sleep(0.1)
        os.killpg(process.pid, number) if number != signal.SIGKILL else process.kill()
        said, _ = process.communicate(timeout=60)
    if number != signal.SIGKILL:
        assert process.returncode == 0
        assert "stopped and saved" in said
    before = final_state(tmp_path / "mixed")["clock"]["samples"]
    more = [f"runs_dir={tmp_path}", "--resume", f"samples={before + 64}"]
    done = subprocess.run([*run, *more], cwd=root, capture_output=True, text=True, check=False, timeout=120)
    assert done.returncode == 0, done.stderr
    assert final_state(tmp_path / "mixed")["clock"]["samples"] == before + 64


def test_ray_collects_what_one_process_collects(tiny: PpoConfig) -> None:
    alone = ppo.train(replace(tiny, name="alone"), resume=False)
    by_ray = ppo.train(replace(tiny, name="by_ray", collect=replace(tiny.collect, actors=1)), resume=False)
    same(final_state(alone), final_state(by_ray))


def test_two_actors_bring_twice_the_samples(tiny: PpoConfig) -> None:
    folder = ppo.train(replace(tiny, collect=CollectConfig(actors=2, envs=4, threads=1, horizon=8)), resume=False)
    clock = final_state(folder)["clock"]
    assert (clock["iteration"], clock["samples"]) == (3, 192)


def test_a_clip_that_makes_physics_explode_ends_episodes_and_reaches_nobody(tiny: PpoConfig) -> None:
    frames = 130
    root = np.zeros((frames, 3))
    root[:, 0], root[:, 2] = 10.0 * np.arange(frames), 0.94  # 10 m in a sixtieth of a second: 600 m/s, and 500 is an explosion
    calm = standing("calm", "ann", frames)
    library = MotionLibrary.from_clips([replace(calm, name="wild", root_position=root), calm])
    actor = CpuCollector(tiny, 0, 0, library.clips, library.arrays(), library.fps, np.array([0.5, 0.5]))
    learner = PpoLearner(tiny)
    failures = 0
    for _ in range(3):
        rollout = actor.collect(learner.weights(), 0.1, 0.0)
        learner.update([rollout], 0.0)
        failures += rollout.physics_failures
        assert np.isfinite(rollout.steps.observations).all()
    assert failures > 0
    assert all(np.isfinite(array).all() for array in learner.weights().values())


def test_an_earlier_run_is_moved_not_overwritten(tiny: PpoConfig) -> None:
    folder = ppo.train(tiny, resume=False)
    kept = (folder / "best" / "policy.safetensors").read_bytes()
    ppo.train(tiny, resume=False)
    assert (folder.with_name("tiny.1") / "best" / "policy.safetensors").read_bytes() == kept


def test_nothing_to_resume(tiny: PpoConfig) -> None:
    with pytest.raises(InputError, match="no checkpoint to resume"):
        ppo.train(tiny, resume=True)


def test_an_unknown_holdout_names_the_performers(tiny: PpoConfig) -> None:
    with pytest.raises(InputError, match="one of ann, bob"):
        ppo.train(replace(tiny, data=replace(tiny.data, holdout="eve")), resume=False)


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["--config", "configs/none.yaml"], "there is no config file"),
        (["--config", "configs/mixed.yaml", "learner.gama=1"], "did you mean 'learner.gamma'?"),
        (["--config", "configs/mixed.yaml", "learner.gamma=2"], "learner.gamma is 2.0, should be from 0 to 1"),
        (["--config", "configs/mixed.yaml", "data.motions=/no/such/place"], "/no/such/place"),
    ],
)
def test_bad_input_is_one_line_and_exit_code_2(arguments: list[str], says: str, tmp_path: Path) -> None:
    command = [sys.executable, "-m", "trainers.ppo", *arguments, f"runs_dir={tmp_path}", "collect.actors=0"]
    done = subprocess.run(command, capture_output=True, text=True, cwd=PROJECT_ROOT, check=False)
    assert done.returncode == 2
    assert says in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1
