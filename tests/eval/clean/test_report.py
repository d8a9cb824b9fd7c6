"""The before/after report of cleaned clips: its numbers, its files, and what it shows without a truth or a way to draw."""

import csv
import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from datasets.damage.damage import SPIKE, Damage
from datasets.motion.clip import BodyMotion
from datasets.motion.humanoid import BODY_NAMES
from datasets.motion.rotation import from_axis_angle
from eval.clean import video as clean_film
from eval.clean.misalignments import Misalignment
from eval.clean.notices import Notice
from eval.clean.report import write_clip_report, write_folder_report
from eval.clean.report_data import CSV_HEADER, collect_report_data, find_most_changed_frames, frames_csv
from eval.clean.result import CleaningResult
from eval.clean.video import _most_changed_part
from eval.metrics.artefact_tracks import compute_artefact_tracks
from eval.pages.artefact_plots import MAX_POINTS, PANELS, plot_artefacts, spans_in_seconds
from eval.pages.render import can_render
from tests.builders import posed

FRAMES = 90
NAME = "take <1> & more"  # must not become HTML


def raised(motion: BodyMotion, height: float) -> BodyMotion:
    """Return a clip so much higher [m]."""
    return replace(motion, root_position=motion.root_position + np.array([0.0, 0.0, height]))


def bowed(motion: BodyMotion, frames: slice, radians: float) -> BodyMotion:
    """Return a clip whose left elbow is bent in some frames."""
    local = motion.local_rotations.copy()
    local[frames, BODY_NAMES.index("forearm_l")] = from_axis_angle(np.array([0.0, 0.0, 1.0]), np.array(-radians))
    return replace(motion, local_rotations=local)


def cleaning(truth: bool = True) -> CleaningResult:
    """Return a T-pose that floats by 3 cm before and stands after, but for the frames 30 to 44 that keep the input.

    In frame 60 and its neighbours the left elbow is bent by 90 degrees.
    """
    clean = posed({}, frames=FRAMES)
    kept = (np.arange(FRAMES) >= 30) & (np.arange(FRAMES) < 45)
    faulty = raised(clean, 0.03)
    height = clean.root_position + np.where(kept, 0.03, 0.0)[:, None] * np.array([0.0, 0.0, 1.0])
    after = bowed(replace(clean, root_position=height), slice(59, 62), np.pi / 2)
    return CleaningResult(
        name=NAME,
        before=faulty,
        after=after,
        contacts=np.stack([~kept, ~kept & (np.arange(FRAMES) < 80)], axis=1),
        confidence=np.where(kept, 0.0, 0.9),
        restarts=(0.75,),
        assist=np.where(np.arange(FRAMES) < 10, 0.08, 0.0),
        notices=(Notice("It sits <down>."),),
        misalignments=(Misalignment("foot_l", "left foot toed in", 7.0, 2.0),),
        truth=clean if truth else None,
        damage=(Damage(SPIKE, 7, 9, ("LeftArm",)),),
    )


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of a report, its film in thumbnails."""
    out = tmp_path_factory.mktemp("out") / "deep"
    with pytest.MonkeyPatch.context() as patch:
        small_pictures(patch)
        write_clip_report(cleaning(), out)
    return out


def small_pictures(patch: pytest.MonkeyPatch) -> None:
    """Make films and pictures tiny."""
    draw = clean_film.pair_frames
    patch.setattr(clean_film, "pair_frames", lambda *args: draw(*args, size=(64, 36)))
    patch.setattr(clean_film, "_MOMENT_SIZE_PX", (48, 64))


def test_numbers_by_side() -> None:
    # 75 of 90 frames stand; the other 15 keep 30 mm: 30 x 15 / 90 = 5 mm.
    report = collect_report_data(cleaning())
    assert report["damage"] == [{"kind": "spike", "start": 7, "stop": 9, "joints": ("LeftArm",), "mended": True}]
    assert {side: values["floating"] for side, values in report["artefacts"].items()} == {
        "before": pytest.approx(30.0), "after": pytest.approx(5.0), "truth": 0.0,
    }  # fmt: skip
    assert report["artefacts"]["before"]["truth_error_world"] == pytest.approx(30.0)
    assert "truth_error_world" not in report["artefacts"]["truth"]
    assert "deviation_local" not in report["artefacts"]["before"]
    assert report["kept"] == {"share": pytest.approx(1 / 6), "spans": [(0.5, 0.75)]}
    assert report["confidence"] == {"mean": pytest.approx(0.75), "lowest": 0.0, "under_half": pytest.approx(1 / 6)}  # 0.9 x 75 / 90
    assert (report["seams"], report["notices"]) == ([0.75], ["It sits <down>."])
    # 0.08 of the body's weight in 10 of the frames that are simulated, which are all but 15.
    assert report["assist_bw"] == pytest.approx({"mean": 0.8 / (FRAMES - 15), "largest": 0.08})
    assert report["misalignments"] == [{"body": "foot_l", "text": "left foot toed in", "degrees": 7.0, "std_degrees": 2.0}]
    # 75 frames of two feet; all are low, and the right one carries nothing in the last ten.
    assert report["contact_rule"]["agree"] == pytest.approx(140 / 150)
    assert report["contact_rule"]["height_alone"] == pytest.approx(10 / 150)


def test_the_frames_most_changed_are_apart_and_say_what_moved() -> None:
    # An elbow bent by 90 degrees moves the hand alone, by 0.25 sqrt 2 m; the mean is over 20 joints. Of the three frames the first counts.
    (one,) = find_most_changed_frames(cleaning())
    hand = 1e3 * 0.25 * np.sqrt(2.0)
    assert (one["frame"], one["seconds"], one["body"]) == (59, pytest.approx(59 / 60), "hand_l")
    assert one["body_mm"] == pytest.approx(hand)
    assert one["deviation_mm"] == pytest.approx(hand / 20)
    twice = replace(cleaning(), after=bowed(cleaning().after, slice(0, 2), np.pi / 6))
    assert [moment["frame"] for moment in find_most_changed_frames(twice)] == [0, 59]
    assert find_most_changed_frames(replace(cleaning(), after=cleaning().before)) == []


def test_each_frame_has_its_row() -> None:
    rows = list(csv.DictReader(frames_csv(cleaning()).splitlines()))
    assert len(rows) == FRAMES
    assert list(rows[0]) == CSV_HEADER.split(",")
    assert list(rows[33].values()) == ["33", "0.5500", "0.000", "1", "0", "0", "0.0", "0.0", "0.000"]
    assert list(rows[85].values()) == ["85", "1.4167", "0.900", "0", "1", "0", "0.0", "30.0", "0.000"]


def test_flags_become_spans() -> None:
    assert spans_in_seconds(np.array([True, False, False, True, True]), 10.0) == [(0.0, 0.1), (0.3, 0.5)]
    assert spans_in_seconds(np.zeros(3, dtype=bool), 10.0) == []


def test_plots_keep_the_worst_frame_of_long_clips() -> None:
    still = posed({}, frames=2 * MAX_POINTS)
    high = still.root_position.copy()
    high[101, 2] -= 0.05  # of the pair of frames 100 and 101
    sides = {"before": compute_artefact_tracks(replace(still, root_position=high)), "after": compute_artefact_tracks(still)}
    plots = dict(plot_artefacts(sides))
    before, after = plots["Body's lowest point"]["data"]
    assert len(before["y"]) == MAX_POINTS
    assert before["y"][50] == pytest.approx(-50.0)
    assert before["x"][50] == pytest.approx(100 / 60, abs=1e-3)
    assert max(map(abs, after["y"])) < 1e-6
    speed = plots["Left foot: speed while in contact"]["data"][0]["y"]
    assert speed[0] == 0.0  # of the first two frames the second is in contact as the first is


def test_a_film_shows_the_part_that_was_changed_most() -> None:
    changes = np.zeros(1000)
    changes[[20, 700, 720]] = 1.0
    part = _most_changed_part(changes, 100)
    assert part.stop - part.start == 100
    assert part.start <= 700 < 720 < part.stop
    assert _most_changed_part(changes, 2000) == slice(0, 1000)


def test_the_report_leaves_three_whole_files(written: Path) -> None:
    assert sorted(file.name for file in written.iterdir()) == ["frames.csv", "index.html", "report.json"]
    report = json.loads((written / "report.json").read_text())
    assert set(report["artefacts"]) == {"before", "after", "truth"}
    assert report["kept"]["spans"] == [[0.5, 0.75]]


def test_the_page_needs_no_network_and_shows_everything(written: Path) -> None:
    page = (written / "index.html").read_text()
    markup = re.sub(r"<script>.*?</script>", "", page, flags=re.DOTALL)  # plotly's own source names addresses that it never opens
    for address in re.findall(r"(?:src|href)\s*=\s*\"([^\"]*)\"", markup):
        assert address.startswith(("#", "data:video/mp4;base64,", "data:image/png;base64,", "frames.csv", "report.json"))
    assert not re.search(r"https?://|url\(|@import", markup)
    assert "take &lt;1&gt; &amp; more" in markup
    assert "It sits &lt;down&gt;." in markup
    assert "<td>left foot toed in</td><td>7</td><td>2</td>" in markup
    assert "−83 %" in markup  # noqa: RUF001 (floating: 30 to 5 mm)
    assert (markup.count("<video"), markup.count("<img")) == ((1, 1) if can_render() else (0, 0))
    figures = [json.loads(text) for text in re.findall(r"class=\"figure\"[^>]*>(.*?)</script>", markup, flags=re.DOTALL)]
    assert len(figures) == len(PANELS) + 3  # and deviation, confidence and help
    assert [line["name"] for line in figures[0]["data"]] == ["before", "after", "truth"]
    shapes = figures[0]["layout"]["shapes"]
    assert [(one["x0"], one["x1"]) for one in shapes] == [(0.5, 0.75), (0.75, 0.75), (0, 1)]  # kept, the seam, the rule of 2 cm


def test_without_a_truth_and_a_way_to_draw_the_report_says_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(clean_film, "can_render", lambda: False)
    report = write_clip_report(cleaning(truth=False), tmp_path)
    page = (tmp_path / "index.html").read_text()
    assert report["artefacts"]["truth"] == {}
    assert "truth_error_local" not in page
    assert "<video" not in page
    assert "libosmesa6" in page


def test_a_folder_has_one_page_with_means_and_links(tmp_path: Path) -> None:
    reports = {"a b/1": collect_report_data(cleaning()), "c": collect_report_data(replace(cleaning(truth=False), after=cleaning().before))}
    write_folder_report(reports, tmp_path)
    table = json.loads((tmp_path / "report.json").read_text())
    assert table["artefacts"]["after"]["floating"] == pytest.approx(17.5)  # 5 and 30 mm
    assert table["artefacts"]["truth"]["floating"] == 0.0
    assert [clip["folder"] for clip in table["clips"]] == ["a b/1", "c"]
    page = (tmp_path / "index.html").read_text()
    assert 'href="a%20b/1/index.html"' in page
    assert page.count("take &lt;1&gt; &amp; more") == 2


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"confidence": np.zeros(3)}, r"confidence has shape \(3,\), should be \(90,\)"),
        ({"after": posed({}, frames=60)}, "90 frames at 60 fps before, 60 at 60"),
    ],
)
def test_sides_of_other_lengths_are_refused(change: dict, says: str) -> None:
    with pytest.raises(ValueError, match=says):
        replace(cleaning(), **change)
