"""The page in a real browser: a clip is dropped, played, its contact dragged, and the clean clip downloaded."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from datasets.formats.motion_file import write_motion_file
from datasets.performer.performer_clip import read_performer_file
from eval.clean.edits import RIGHT
from eval.clean.edits_file import read_edits
from eval.clean.session import CleaningSession
from eval.studio.studio_server import StudioServer
from tests.eval.browser import Browser, browser
from tests.eval.studio.studio_parts import dress_clips, small_pipeline, workspace, write_clip

WINDOW_PX = (1180, 720)
TRACKS = "[...document.querySelectorAll('.multi-slider-track-container')]"  # time, left foot, right foot
DROP_FIELD = "document.querySelector('input[type=file]')"
FREE = np.s_[150:380, 320:820]  # rows and columns of a picture of the page that nothing covers
BLUER = 60  # than red, of 255, in the cleaned figure
SECONDS = 60.0


def says(text: str) -> str:
    """Return the expression that the page says something."""
    return f"document.body.innerText.includes({text!r})"


def button(text: str, number: int = 0) -> str:
    """Return the expression of a button, of several with this text the one of a number."""
    return f"[...document.querySelectorAll('button')].filter(one => one.innerText.trim() === {text!r})[{number}]"


def tab(text: str) -> str:
    """Return the expression of a panel's tab."""
    return f"[...document.querySelectorAll('[role=tab]')].find(one => one.innerText.trim() === {text!r})"


def wait(what: Callable[[], bool]) -> None:
    """Wait until something is true."""
    end = time.monotonic() + SECONDS
    while not what():
        assert time.monotonic() < end
        time.sleep(0.05)


@contextmanager
def studio(source: Path | None, uploads: Path) -> Iterator[StudioServer]:
    """Serve a studio with small physics."""
    with workspace(source, uploads) as opened:
        server = StudioServer(opened, 0)
        try:
            yield server
        finally:
            server.close()


def open_page(view: Browser, server: StudioServer) -> None:
    """Open the page, drawn coarsely, as software draws here."""
    view.open(f"{server.address}/?fixedDpr=0.1")
    view.until(says("Open a clip"))


def drag_end(view: Browser, foot: int, end: int, share: float) -> None:
    """Drag an end of a foot's contact to a share of the track."""
    track, thumb = f"{TRACKS}[{foot + 1}]", f"{TRACKS}[{foot + 1}].querySelectorAll('.multi-slider-thumb')[{end}]"
    left, top, width, height = view.box(track)
    x, y, wide, high = view.box(thumb)
    view.drag((x + wide / 2, y + high / 2), (left + share * width, top + height / 2))


def scrub(view: Browser, start: float, end: float, shows: str) -> None:
    """Drag along the frames from a share of the track to another, again until an expression says so: a busy page misses some."""
    stop = time.monotonic() + SECONDS
    while not view.value(shows):
        assert time.monotonic() < stop, f"never true: {shows}"
        left, top, width, height = view.box(f"{TRACKS}[0]")
        view.drag((left + start * width, top + height / 2), (left + end * width, top + height / 2))
        time.sleep(1.0)


def test_a_clip_is_dropped_scrubbed_edited_and_saved(tmp_path: Path) -> None:
    clip, kept, got = write_clip(tmp_path), tmp_path / "kept", tmp_path / "got"
    got.mkdir()
    with studio(None, kept) as server, browser(tmp_path / "profile", WINDOW_PX) as view:
        view.save_downloads(got)
        open_page(view, server)
        view.drop_file(DROP_FIELD, clip)
        view.until(says("sway is taken for"))
        view.until(says("frame 1 of 120"))
        scrub(view, 0.5, 0.75, "/frame (89|90|91) of 120/.test(document.body.innerText)")  # three quarters of 119 frames after the first
        view.click(tab("Edit"))
        view.click(button("to"))
        scrub(view, 0.0, 0.25, "/frame (30|31) of 120/.test(document.body.innerText)")
        view.click(button("from"))
        edits = kept / "sway.edits.json"
        assert not edits.exists()
        view.click(f"{button('does not stand', 1)}")
        wait(edits.exists)
        wait(lambda: len(read_edits(edits).contacts) == 1)
        view.until(f"{TRACKS}[2].querySelectorAll('.multi-slider-thumb').length === 2")  # where it lifts off, and where it lands
        drag_end(view, 1, 1, 0.9)
        wait(lambda: len(read_edits(edits).contacts) == 2)
        lift, longer = read_edits(edits).contacts
        assert (lift.foot, lift.stands, longer.foot, longer.stands) == (RIGHT, False, RIGHT, False)
        assert lift.start_s == pytest.approx(0.5, abs=0.05)
        assert longer.start_s == pytest.approx(1.5, abs=0.05)
        assert longer.stop_s == pytest.approx(0.9 * 119 / 60, abs=0.05)
        view.click(tab("Save"))
        view.click(button("Download"))
        wait(lambda: (got / "sway_clean.bvh").is_file())
    session = CleaningSession(read_performer_file(clip, None), "sway", small_pipeline())
    write_motion_file(tmp_path / "command.bvh", session.write(session.solve(read_edits(edits))), clip)
    assert (got / "sway_clean.bvh").read_bytes() == (tmp_path / "command.bvh").read_bytes()


def test_another_clip_is_dropped_or_chosen_and_a_problem_is_told(tmp_path: Path) -> None:
    shown, dropped, chosen, text = (*(write_clip(tmp_path, f"{name}.bvh") for name in ("shown", "dropped", "chosen")), tmp_path / "a.txt")
    text.write_text("no motion")
    with studio(shown, tmp_path / "kept") as server, browser(tmp_path / "profile", WINDOW_PX) as view:
        open_page(view, server)
        view.until(says("shown is taken for"))
        view.drop_file(DROP_FIELD, dropped)
        view.until(says("dropped is taken for"))
        view.drop_file(DROP_FIELD, text)
        view.until(says("a.txt: no BVH"))
        view.choose_file("input[type=file]", chosen)
        view.until(says("chosen is taken for"))
        assert view.value("location.origin") == server.address  # the browser did not open a file itself


def figure_pixels(view: Browser) -> np.ndarray:
    """Return which pixels of the page's free part are the cleaned figure's, once two pictures on end are the same."""
    masks: list[np.ndarray] = []
    while len(masks) < 2 or not masks[-1].sum() or (masks[-1] != masks[-2]).any():
        red, _, blue = np.moveaxis(np.asarray(Image.open(BytesIO(view.screenshot())).convert("RGB"), dtype=int)[FREE], -1, 0)
        masks.append(blue - red > BLUER)
        assert len(masks) < 100
        time.sleep(0.2)
    return masks[-1]


def test_a_mesh_of_the_humanoids_shapes_looks_like_the_humanoid(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    dress_clips(monkeypatch, "dressed.bvh")
    clip = write_clip(tmp_path, "dressed.bvh")
    with studio(clip, tmp_path / "kept") as server, browser(tmp_path / "profile", WINDOW_PX) as view:
        open_page(view, server)
        view.until(says("frame 1 of 120"))
        (shown,) = server.tabs.values()
        assert shown.project
        shown.project.solver.wait()
        shown.seek(1.5)
        humanoid = figure_pixels(view)
        view.click(tab("View"))
        view.click("[...document.querySelectorAll('input')].find(one => one.value === 'humanoid')")
        view.click("[...document.querySelectorAll('[role=option]')].find(one => one.innerText.trim() === 'mesh')")
        wait(lambda: shown.client.scene.get_handle_by_name("/world/after mesh/skin") is not None)
        time.sleep(1.0)
        mesh = figure_pixels(view)
    assert humanoid.sum() > 1000
    assert (humanoid & mesh).sum() > 0.9 * (humanoid | mesh).sum()
