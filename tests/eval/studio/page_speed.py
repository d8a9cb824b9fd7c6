"""Times of the studio's page in a headless Chromium: a walk through it, and frames that are drawn while two figures play.

    python -m tests.eval.studio.page_speed walk dance.bvh
    python -m tests.eval.studio.page_speed play dance.bvh

For docs/studio.md; no test. Chromium draws in software (SwiftShader), so frames a second are the machine's, not a graphics card's.
"""

import sys
import time
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory

from eval.studio.page.tab import Tab
from eval.studio.state.workspace import Workspace
from eval.studio.studio_server import StudioServer
from tests.eval.browser import Browser, browser
from tests.eval.studio.test_page import DROP_FIELD, TRACKS, button, drag_end, says, tab

WALKED_PAGE_PX = (1180, 720)
# Page [pixels], sharpness of the picture as a share of the page's pixels (fixedDpr), shadows.
PLAYED = tuple((page, sharpness, shadows) for page in ((640, 360), (1180, 720)) for sharpness in (1.0, 0.5) for shadows in (True, False))
PLAYED_S, SETTLED_S = 8.0, 4.0
LIMIT_S = 1800.0
# Counts the frames in which WebGL drew something.
COUNT_FRAMES = """
window.drawnFrames = 0;
let drew = false;
for (const name of ["drawElements", "drawArrays", "drawElementsInstanced", "drawArraysInstanced"]) {
  const draw = WebGL2RenderingContext.prototype[name];
  WebGL2RenderingContext.prototype[name] = function (...given) { drew = true; return draw.apply(this, given); };
}
(function next() { window.drawnFrames += drew; drew = false; requestAnimationFrame(next); })();
"""


def main(what: str, clip: Path) -> None:
    """Print the times of a clip: of the walk, or of frames while it plays."""
    with TemporaryDirectory() as folder:
        workspace = Workspace(None, Path(folder) / "kept")
        assert workspace.pipeline.simulator
        server = StudioServer(workspace, 0)
        try:
            if what == "walk":
                walk(server, clip, Path(folder))
            else:
                workspace.open(clip).solver.wait()
                for page, sharpness, shadows in PLAYED:
                    play(server, page, sharpness, shadows, Path(folder))
        finally:
            server.close()


def walk(server: StudioServer, clip: Path, folder: Path) -> None:
    """Open a clip, move a contact, clean it with good quality and save it as BVH, as a person clicks; print when each was done."""
    with browser(folder / "walk") as view:
        view.resize(WALKED_PAGE_PX)
        view.save_downloads(folder)
        view.open(f"{server.address}/?fixedDpr=0.5")
        view.until(says("Open a clip"))
        begin = time.monotonic()

        def tell(what: str, done: Callable[[], bool]) -> None:
            while not done():
                assert time.monotonic() < begin + LIMIT_S
                time.sleep(0.05)
            print(f"{time.monotonic() - begin:7.1f} s  {what}", flush=True)

        view.drop_file(DROP_FIELD, clip)
        tell("the recording is on the page", lambda: view.value(says(f"{clip.stem} is taken for")))
        tell("the first version is", lambda: view.value(says("physics is to be done")))
        (shown,) = server.tabs.values()
        project = shown.project
        assert project
        project.solver.wait()
        view.until(f"{TRACKS}[1].querySelectorAll('.multi-slider-thumb').length > 2")
        started, version = time.monotonic() - begin, project.result
        box, thumb = view.box(f"{TRACKS}[1]"), view.box(f"{TRACKS}[1].querySelectorAll('.multi-slider-thumb')[1]")
        drag_end(view, 0, 1, (thumb[0] + thumb[2] / 2 - box[0]) / box[2] + 0.01)
        tell(f"a contact is moved, begun after {started:.1f} s", lambda: project.result is not version and not project.solver.is_busy)
        view.click(tab("Clean"))
        view.click(button("Clean"))
        tell("cleaned with good quality", lambda: view.value(says("performed by the humanoid")))
        view.click(tab("Save"))
        view.click(button("Download"))
        tell("saved as BVH", (folder / f"{clip.stem}_clean.bvh").is_file)


def play(server: StudioServer, page: tuple[int, int], sharpness: float, shadows: bool, folder: Path) -> None:
    """Play two figures on a page of a size [pixels]; print frames a second and what a frame costs the page's main thread."""
    name = f"{page[0]}x{page[1]}-{sharpness:g}-{'shadows' if shadows else 'none'}"
    before = set(server.tabs)
    with browser(folder / name) as view:
        view.resize(page)
        view.before_pages(COUNT_FRAMES)
        view.open(f"{server.address}/?fixedDpr={sharpness:g}")
        view.until(says("frame 1 of"))
        (number,) = set(server.tabs) - before
        shown: Tab = server.tabs[number]
        shown.options.shadows = shadows
        shown.refresh()
        shown.playback.play(True)
        time.sleep(SETTLED_S)
        frames, costs, begin = _measured(view)
        time.sleep(PLAYED_S)
        more, later, end = _measured(view)
        drawn, seconds = more - frames, end - begin
        scripts, tasks = (1e3 * (later[key] - costs[key]) for key in ("ScriptDuration", "TaskDuration"))
        view_of = f"{page[0]} x {page[1]}, fixedDpr={sharpness:g}, shadows {'on' if shadows else 'off'}"
        print(
            f"{view_of}: {drawn / seconds:.1f} frames/s; main thread: "
            f"scripts {scripts / max(drawn, 1):.1f} ms a frame, {scripts / seconds:.0f} ms a second, all {tasks / seconds:.0f} ms a second",
            flush=True,
        )


def _measured(view: Browser) -> tuple[int, dict[str, float], float]:
    """Return the frames drawn so far, Chromium's metrics of the page [s], and the time [s]."""
    return view.value("window.drawnFrames"), view.metrics(), time.monotonic()


if __name__ == "__main__":
    main(sys.argv[1], Path(sys.argv[2]))
