"""The report of a run: its arithmetic, its files, and its messages about bad input."""

import json
import re
from dataclasses import asdict, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from torch.utils.tensorboard import SummaryWriter

from agents.policy.policy import Policy
from configs.errors import InputError
from configs.load import save_config
from datasets.formats.bvh import write_bvh
from datasets.library.motion_library import ClipInfo, MotionLibrary
from datasets.library.sources import SourceMotion
from datasets.motion.clip import BodyMotion
from datasets.motion.generalised_positions import motion_to_qpos
from envs.mimic.spec import MimicSpec
from eval.metrics.rollout_motion import (
    ArtefactComparison,
    RolloutMotion,
    compare_artefacts,
    mean_over_clips,
    mean_over_windows,
    poses_to_motion,
    simulate_rollouts,
)
from eval.metrics.tracking import ClipTracking, group_clips, summarise, survival_shares
from eval.pages.artefact_plots import PANELS
from eval.pages.render import can_render, render_pair
from eval.report import cli as report
from eval.report import clip_selection as tested_clips
from eval.report import videos as films
from eval.report.clip_selection import choose_clips
from eval.report.data import collect_report
from eval.report.evaluate import ClipResults
from eval.runs.trained_run import load_run
from eval.runs.training_curves import read_curves
from tests.builders import as_bvh, posed
from trainers.algorithms.ppo_config import NetworkConfig, PpoConfig
from trainers.data.motion_config import DataConfig
from trainers.evaluation.evaluation_protocol import evaluate_rollouts, evaluation_rollouts, zero_residual

SPEC = MimicSpec()
CARD = {"clips": ["stand_1", "stand_2#1"], "performers": ["ann"], "held_out": "bob"}
NAME = "take <1> & more"  # must not become HTML


def standing(name: str, frames: int = 180, performer: str = "cleo", kind: str = "stand", system: str = "optical") -> BodyMotion:
    """Return a clip of somebody who stands with hanging arms."""
    return replace(
        posed({"upper_arm_l_x": -70.0, "upper_arm_r_x": 70.0}, frames=frames), name=name, performer=performer, kind=kind, system=system
    )


def tracking(name: str, kind: str, frames: int, ratios: list[float]) -> ClipTracking:
    """Return made-up results of a clip whose zero residual lasts half as long as the policy."""
    values = np.array(ratios)
    metrics = {"episode_length_ratio": values, "sr90": (values >= 0.9).astype(float)}
    zero = {"episode_length_ratio": values / 2, "sr90": 0.0 * values}
    return ClipTracking(ClipInfo(name, "cleo", "optical", kind, 0, frames + 20), 1, frames, metrics, zero)


@pytest.fixture(scope="module")
def run_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of a run that learnt nothing: config, events and a random policy."""
    folder = tmp_path_factory.mktemp("runs") / "tiny"
    (folder / "best").mkdir(parents=True)
    save_config(PpoConfig(name="tiny", data=DataConfig(motions="synthetic"), network=NetworkConfig(hidden=(8,))), folder / "config.yaml")
    rest = {"task": asdict(SPEC), "motions": "synthetic", "samples": 2000, "hours": 0.5, "code": "abc"}
    Policy(SPEC.observation_size, SPEC.action_size, (8,)).save(folder / "best" / "policy.safetensors", {**CARD, **rest})
    with SummaryWriter(str(folder)) as writer:
        for samples, value in ((1000, 0.25), (2000, 0.5)):
            writer.add_scalar("training/episode_length_ratio", value, samples)
    return folder


@pytest.fixture(scope="module")
def motions(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with a clip of 2.5 s and one of 1 s."""
    folder = tmp_path_factory.mktemp("motions")
    write_bvh(folder / f"{NAME}.bvh", as_bvh(standing("", 150)))
    write_bvh(folder / "short.bvh", as_bvh(standing("", 60)))
    return folder


@pytest.fixture(scope="module")
def written(run_folder: Path, motions: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder that the command left, films in thumbnails."""
    out = tmp_path_factory.mktemp("out") / "deep" / "report"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(films, "render_pair", partial(render_pair, size=(64, 36)))
        assert report.main(["--run", str(run_folder), "--out", str(out), "--motions", str(motions)]) == 0
    return out


def test_means_and_deviations_are_over_all_rollouts() -> None:
    found = summarise([{"a": np.array([1.0, 2.0])}, {"a": np.array([6.0])}])
    # mean 9 / 3; squared distances 4, 1 and 9, so the variance is 14 / 3
    assert found == {"a": {"mean": pytest.approx(3.0), "std": pytest.approx((14 / 3) ** 0.5)}}
    assert summarise([]) == {}


def test_clips_are_grouped_with_their_suited_twins() -> None:
    one, two, suited = (tracking(*args, 300, [1.0]) for args in (("a", "walk"), ("b", "run"), ("a_suit", "walk")))
    found = group_clips([one, two], [suited], lambda clip: clip.kind)
    assert found == {"run": ([two], []), "walk": ([one], [suited])}


def test_shares_of_running_rollouts() -> None:
    # References of 5 s and 2 s. Rollouts last 5 s and 2.5 s of the first, 2 s of the second.
    parts = [tracking("a", "walk", 300, [1.0, 0.5]), tracking("b", "walk", 120, [1.0])]
    shares = survival_shares(parts, False, np.array([0.0, 2.0, 2.5, 3.0, 5.0, 6.0]), 60.0)
    np.testing.assert_allclose(shares, [1.0, 1.0, 1.0, 0.5, 0.5, np.nan])
    # The zero residual lasts 2.5 s, 1.25 s and 1 s; at 2 s all three references still run, at 2.5 s two.
    np.testing.assert_allclose(survival_shares(parts, True, np.array([1.0, 2.0, 2.5, 3.0]), 60.0), [1.0, 1 / 3, 1 / 2, 0.0])


def test_artefacts_are_weighted_by_frames_in_a_clip_and_equally_over_clips() -> None:
    windows = [ArtefactComparison({"jitter": 1.0}, {"jitter": 5.0}, {}, 100), ArtefactComparison({"jitter": 4.0}, {"jitter": 8.0}, {}, 200)]
    clip = mean_over_windows(windows)
    # (1 + 2 x 4) / 3, (5 + 2 x 8) / 3
    assert clip == {"before": {"jitter": pytest.approx(3.0)}, "after": {"jitter": pytest.approx(7.0)}, "truth": {}}
    over = mean_over_clips([clip, {"before": {"jitter": 1.0}, "after": {"jitter": 1.0}, "truth": {"jitter": 0.5}}])
    # (3 + 1) / 2, (7 + 1) / 2; only one clip has a truth
    assert over == {"before": {"jitter": pytest.approx(2.0)}, "after": {"jitter": pytest.approx(4.0)}, "truth": {"jitter": 0.5}}
    assert mean_over_clips([]) == {"before": {}, "after": {}, "truth": {}}


def test_a_performance_is_what_the_protocol_measured() -> None:
    library = MotionLibrary.from_clips([standing("a", 180)])
    rollouts, _ = evaluation_rollouts(library, offset_step=10)
    act = zero_residual(SPEC)
    performances = simulate_rollouts(act, library, SPEC, rollouts, 1)
    measured = evaluate_rollouts(act, library, SPEC, rollouts, 1)["episode_length_ratio"]
    assert [one.frame for one in performances] == [0, 10]
    for one, ratio in zip(performances, measured, strict=True):
        assert one.poses.shape == (81, 50)  # 160 frames of reference are 80 steps
        assert min(one.survived, 80) / 80 == pytest.approx(ratio)
        np.testing.assert_allclose(one.poses[0], library.start_pose[one.frame], atol=1e-6)


def test_who_performs_the_clip_itself_deviates_by_nothing() -> None:
    clip = standing("a", 181)
    performance = RolloutMotion(0, 20, motion_to_qpos(clip)[20::2], survived=40)
    found = compare_artefacts(performance, clip, None)
    assert found is not None
    assert found.frames == 79  # 40 poses span 39 steps of two frames
    assert found.after["deviation_world"] == pytest.approx(0.0, abs=1e-6)
    assert "deviation_world" not in found.before
    assert found.after["floating"] == pytest.approx(found.before["floating"], abs=1e-6)
    assert compare_artefacts(performance._replace(survived=3), clip, None) is None


def test_the_truth_is_put_where_the_window_begins_but_keeps_its_height() -> None:
    clip = standing("a", 121)
    truth = replace(clip, root_position=clip.root_position + np.array([3.0, -4.0, 0.1]))
    found = compare_artefacts(RolloutMotion(0, 0, motion_to_qpos(clip)[::2], survived=61), clip, truth)
    assert found is not None
    assert found.before["truth_error_world"] == pytest.approx(100.0)  # mm: 5 m over the ground are forgiven, 0.1 m of height not
    assert found.after["truth_error_world"] == pytest.approx(100.0)


def test_poses_become_a_clip_at_60_fps() -> None:
    found = poses_to_motion(motion_to_qpos(standing("a", 61))[::2], standing("like"))
    assert (len(found), found.fps, found.name) == (61, 60.0, "like")
    np.testing.assert_allclose(found.local_rotations, standing("a", 61).local_rotations, atol=1e-9)


def test_short_clips_and_stairs_are_left_out_and_named(monkeypatch: pytest.MonkeyPatch) -> None:
    clips = [standing("ok", 120), standing("short", 119), standing("up", kind="stairs"), standing("suit", system="imu")]
    monkeypatch.setattr(tested_clips, "_find", lambda *_: ("here", [SourceMotion(clip) for clip in clips]))
    found = choose_clips(DataConfig(), CARD, None, lambda _: None)
    assert [clip.name for clip in found.recorded] == ["ok", "suit"]
    assert found.left_out == {"short": "lasts 1.98 s, under 2 s", "up": "stairs: the simulated ground is flat"}
    assert [clip.name for clip in found.suited] == ["ok_suit"]  # a suit's own recording is no truth for another
    assert found.truths == [clips[0]]
    monkeypatch.setattr(tested_clips, "_find", lambda *_: ("here", [SourceMotion(clip) for clip in clips[1:3]]))
    with pytest.raises(InputError, match="none of 2 clips is on flat ground and at least 2 s long"):
        choose_clips(DataConfig(), CARD, None, lambda _: None)


def test_what_training_saw_is_marked(monkeypatch: pytest.MonkeyPatch) -> None:
    clips = [standing("stand_1"), standing("stand_2"), standing("x", performer="ann"), standing("y", performer="bob"), standing("z")]
    monkeypatch.setattr(tested_clips, "_find", lambda *_: ("here", [SourceMotion(clip) for clip in clips]))
    found = choose_clips(DataConfig(), CARD, None, lambda _: None)
    assert found.seen_in == {"stand_1": "training", "stand_2": "training", "x": "training", "y": "model selection"}


def test_by_default_the_clips_of_the_held_out_performer_are_tested(tmp_path: Path) -> None:
    for name in ("ann_1", "ann_2", "bob_1"):
        write_bvh(tmp_path / f"{name}.bvh", as_bvh(standing("", 130)))
    found = choose_clips(DataConfig(motions=str(tmp_path)), CARD, None, lambda _: None)
    assert [clip.name for clip in found.recorded] == ["bob_1"]
    assert found.source == f"bob, held out of {tmp_path}"
    with pytest.raises(InputError, match="--motions"):
        choose_clips(DataConfig(motions=str(tmp_path)), {**CARD, "held_out": "none"}, None, lambda _: None)


def test_a_run_on_synthetic_motion_is_tested_on_other_synthetic_performers(monkeypatch: pytest.MonkeyPatch) -> None:
    asked = []

    def make(source: str, *_: Any, seed: int = 0) -> list[SourceMotion]:
        asked.append((source, seed))
        return [SourceMotion(standing("made"))]

    monkeypatch.setattr(tested_clips, "load_source_motions", make)
    choose_clips(DataConfig(seed=7), CARD, None, lambda _: None)
    choose_clips(DataConfig(seed=7), CARD, ["synthetic"], lambda _: None)
    assert asked == [("synthetic", 1007), ("synthetic", 1007)]


def test_files_named_twice_are_read_once_under_unique_names(tmp_path: Path) -> None:
    for folder in ("a", "b"):
        (tmp_path / folder).mkdir()
        write_bvh(tmp_path / folder / "take.bvh", as_bvh(standing("", 130)))
    found = choose_clips(DataConfig(), CARD, [str(tmp_path), str(tmp_path / "a" / "take.bvh")], lambda _: None)
    assert [clip.name for clip in found.recorded] == ["a/take", "b/take"]


def test_what_was_guessed_is_told_once_for_each_folder(tmp_path: Path) -> None:
    for name in ("a/one.bvh", "a/two.bvh", "b/three.bvh"):
        path = tmp_path / name
        path.parent.mkdir(exist_ok=True)
        write_bvh(path, as_bvh(standing("", 130)))
        path.write_text(path.read_text().replace("HIERARCHY", "HIERARCHY # by hand", 1))
    said: list[str] = []
    choose_clips(DataConfig(), CARD, [str(tmp_path)], said.append)
    of_a, of_b = (line for line in said if "something guessed" in line)
    assert of_a.startswith(f"{tmp_path / 'a'}: 2 of 2 files were read with something guessed or mended")
    assert of_b.endswith(f"python -m datasets.describe {tmp_path / 'b'}")


def test_curves_come_back_from_the_events(run_folder: Path, tmp_path: Path) -> None:
    assert read_curves(run_folder) == {"training/episode_length_ratio": ([1000.0, 2000.0], [0.25, 0.5])}
    assert read_curves(tmp_path) == {}


def test_the_command_leaves_whole_files_and_a_picture_where_it_can_draw(written: Path) -> None:
    pictures = ["best.png"] if can_render() else []
    assert sorted(file.name for file in written.iterdir()) == [*pictures, "index.html", "report.json"]


def test_the_json_has_the_keys_that_other_tools_read(written: Path) -> None:
    found = json.loads((written / "report.json").read_text())
    always = {"episode_length_ratio", "root_mse", "sr90", "max_reward_ratio", "body_error", "upright_ratio"}
    assert set(found["tracking"]) == set(found["tracking_zero_residual"]) == always
    assert set(found["tracking_suit"]) == set(found["tracking_suit_zero_residual"]) == {*always, "root_mse_truth"}
    # Who has fallen is not upright, and who is lost may be: no rollout is upright for less time than it lasts but by a step.
    assert found["tracking"]["upright_ratio"]["mean"] >= found["tracking"]["episode_length_ratio"]["mean"] - 0.02
    assert all(set(value) == {"mean", "std"} for value in found["tracking"].values())
    assert {"foot_skate", "floating", "ground_penetration", "jitter"} <= set(found["artefacts"]["before"])
    assert {"deviation_local", "deviation_world"} <= set(found["artefacts"]["after"])
    assert {"truth_error_local", "truth_error_world"} <= set(found["artefacts_suit"]["after"])
    assert set(found["artefacts_suit"]["truth"]) == set(found["artefacts"]["before"])
    (clip,) = found["clips"]
    assert (clip["name"], clip["seconds"], clip["windows"], clip["rollouts"]) == (NAME, 2.5, 1, 20)
    assert clip["tracking"] == found["tracking"]  # there is one clip
    assert found["left_out"] == [{"name": "short", "reason": "lasts 1.00 s, under 2 s"}]
    assert found["config"]["network"]["hidden"] == [8]


def test_the_page_needs_no_network_and_shows_everything(written: Path) -> None:
    page = (written / "index.html").read_text()
    markup = re.sub(r"<script>.*?</script>", "", page, flags=re.DOTALL)  # plotly's own source names addresses that it never opens
    assert page.count("<script>") == 2
    for address in re.findall(r"(?:src|href)\s*=\s*\"([^\"]*)\"", markup):
        assert address.startswith(("#", "data:video/mp4;base64,"))
    assert not re.search(r"https?://|url\(|@import", markup)
    assert "take &lt;1&gt; &amp; more" in markup
    assert "<1>" not in markup
    assert "lasts 1.00 s, under 2 s" in markup
    assert len(re.findall(r"<video", markup)) == (1 if can_render() else 0)  # of one clip the best is also the worst
    figures = [json.loads(text) for text in re.findall(r"class=\"figure\"[^>]*>(.*?)</script>", markup, flags=re.DOTALL)]
    assert len(figures) == 2 + len(PANELS) + 1  # survival, by clip; artefacts over time; the one curve of the events
    assert [line["name"] for line in figures[2]["data"]] == ["before", "after", "truth"]
    assert all("[" in figure["layout"]["xaxis"]["title"]["text"] for figure in figures)


def test_without_a_way_to_render_the_report_says_what_to_install(
    run_folder: Path, motions: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(films, "can_render", lambda: False)
    assert report.main(["--run", str(run_folder), "--out", str(tmp_path), "--motions", str(motions / f"{NAME}.bvh")]) == 0
    page = (tmp_path / "index.html").read_text()
    assert "<video" not in page
    assert "libosmesa6" in page
    assert "libosmesa6" in capsys.readouterr().out


def test_a_report_without_suited_clips_is_whole(run_folder: Path) -> None:
    run = load_run(run_folder)
    clips = tested_clips.EvaluationClips("here", [standing("a")], [], [], {}, {}, {})
    results = [tracking("a", "walk", 160, [1.0])]
    recorded = ClipResults(clips.recorded, results, [], {}, 0.0)
    found = collect_report(run, clips, recorded, ClipResults([], [], [], {}, 0.0), 1.0)
    assert found["tracking_suit"] == {}
    assert found["artefacts"] == {"before": {}, "after": {}, "truth": {}}
    assert found["by_kind"]["walk"]["tracking"]["sr90"] == {"mean": 1.0, "std": 0.0}


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"--run": "nowhere"}, "there is no run at nowhere"),
        ({"--run": "."}, "there is no policy at"),
        ({"--motions": "nowhere.bvh"}, "nowhere.bvh: no such file or folder"),
        ({"--out": "file"}, "--out file"),
    ],
)
def test_bad_input_is_one_line_and_leaves_nothing(
    change: dict[str, str], says: str, run_folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("file").write_text("")
    options = {"--run": str(run_folder), "--out": "out", **change}
    assert report.main([text for pair in options.items() for text in pair]) == 2
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 1
    assert says in lines[0]
    assert [path.name for path in tmp_path.iterdir()] == ["file"]
