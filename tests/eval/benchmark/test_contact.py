"""The contact benchmark on two short clips: what it writes, which clips it takes, and what it refuses."""

import json
from pathlib import Path

import pytest
import torch

from datasets.motion.clip import BodyMotion
from envs.mimic.spec import MimicSpec
from eval.benchmark import cli as benchmark
from eval.benchmark import contact as benchmark_contact
from eval.benchmark.contact import choose_clips, measure_contact
from eval.benchmark.contacts.measurement import GroundContact
from eval.benchmark.contacts.model_variants import IN_USE, PREVIOUS, VARIANT_BY_TIME_STEP_S, VARIANTS
from eval.evaluation_recordings import TEST_CLIPS
from tests.builders import posed
from trainers.evaluation.evaluation_protocol import zero_residual

NEEDED = {PREVIOUS, *VARIANT_BY_TIME_STEP_S.values()}


@pytest.fixture
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    """Measure two standing clips with no policy, on few worlds."""
    monkeypatch.setattr(benchmark_contact, "NUM_TIMED_WORLDS", 2)
    clips = {"stand": [posed({}, 40)], "bow": [posed({"spine_y": 20.0}, 30)]}
    needed = [variant for variant in VARIANTS if variant.name in NEEDED]

    def run(motions: str, rounds: int, after_round: benchmark.Callable[[], None]) -> benchmark.BenchmarkResult:
        return measure_contact(clips, zero_residual(MimicSpec()), MimicSpec(), needed, rounds, after_round)

    monkeypatch.setitem(benchmark.BENCHMARKS, "contact", run)


@pytest.mark.usefixtures("three_threads")
def test_benchmark_writes_figures_and_a_picture(small: None, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    threads = torch.get_num_threads()
    files = ["--json", str(tmp_path / "contact.json"), "--plot", str(tmp_path / "contact.png")]
    assert benchmark.main(["contact", "--rounds", "1", *files]) == 0
    assert torch.get_num_threads() == threads
    found = json.loads((tmp_path / "contact.json").read_text())
    names = [variant.name for variant in VARIANTS if variant.name in NEEDED]
    assert list(found["contact"]) == list(found["cost"]) == names
    assert found["cost"][PREVIOUS] == 1.0
    for modes in found["contact"].values():
        assert set(modes) == {"held", "policy"}
        for measures in modes.values():
            assert set(measures) == set(GroundContact._fields)
            assert measures["lasted"] == 1.0  # nobody falls in half a second
            assert measures["contacts"] > 1.0
    assert set(found["kinds"][IN_USE]) == {"stand", "bow"}
    assert 0.0 < found["kinds"][IN_USE]["stand"]["depth"] < 1.0
    assert (tmp_path / "contact.png").read_bytes().startswith(b"\x89PNG")
    said = capsys.readouterr().out
    assert "Root held, half the time step changes the slip by" in said
    assert "root held, no policy" in said


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["env", "--plot", "x.png"], "error: --plot x.png: the benchmark env draws nothing, contact does"),
        (["contact", "--plot", "/nowhere/at/all.png"], "error: --plot /nowhere/at/all.png: there is no folder /nowhere/at"),
    ],
)
def test_a_picture_that_cannot_be_is_refused_at_once(arguments: list[str], message: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert benchmark.main(arguments) == 2
    assert message in capsys.readouterr().err


def test_of_another_source_two_clips_of_each_kind_are_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    def clip(number: int, kind: str) -> BodyMotion:
        still = posed({}, 10)
        return type(still)(still.root_position, still.local_rotations, 60.0, f"{kind}_{number}", "ann", "optical", kind)

    clips = [clip(number, kind) for kind in ("walk", "run") for number in range(3)]
    monkeypatch.setattr(benchmark_contact, "load_clips", lambda _: clips)
    found = choose_clips("elsewhere")
    assert {kind: [one.name for one in each] for kind, each in found.items()} == {"walk": ["walk_0", "walk_1"], "run": ["run_0", "run_1"]}


@pytest.mark.shared_data
def test_a_dozen_real_clips_are_there(shared_data: Path) -> None:
    found = choose_clips(str(shared_data))
    assert {kind: len(each) for kind, each in found.items()} == {kind: len(names) for kind, names in TEST_CLIPS.items()}
    assert sum(map(len, found.values())) == 12
