"""Costs of a tab for the program, without a browser: playing, posing a mesh, sending it, and drawing the timeline.

    python -m tests.eval.studio.page_cost dance.bvh

For docs/studio.md; no test.
"""

import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from time import process_time

import numpy as np
from websockets.exceptions import ConnectionClosed

from datasets.formats.bvh import Bvh, write_bvh
from datasets.performer.performer_clip import read_performer_file
from datasets.performer.reading_options import ReadingOptions
from eval.benchmark.studio import LONG_S, there_and_back
from eval.clean.pipeline import CleaningPipeline
from eval.studio.page.tab import Tab
from eval.studio.state import project
from eval.studio.state.view_options import HUMANOID, MESH
from eval.studio.state.workspace import Workspace
from eval.studio.studio_server import StudioServer
from tests.eval.studio.studio_parts import skinned
from tests.eval.viewer.viewer_parts import open_tab, wait

PLAYED_S, SETTLED_S = 10.0, 3.0
DRAWN, PAGES = 200, 50  # poses and pages of the timeline, of which the mean is told
MESH_VERTICES = 100_000


def main(clip: Path) -> None:
    """Print the costs of a clip's tab."""
    project.read_performer_file = _read_with_mesh
    with TemporaryDirectory() as folder:
        long = Path(folder) / "long.bvh"
        recorded = read_performer_file(clip, None)
        write_bvh(long, there_and_back(replace(recorded, values=recorded.values[: round(10.0 / recorded.frame_time)]), LONG_S))
        workspace = Workspace(clip, Path(folder) / "kept", lambda: CleaningPipeline.load(1).without(["restore"]))
        server = StudioServer(workspace, 0)
        reader = subprocess.Popen([sys.executable, "-m", "tests.eval.studio.page_cost", "--read", server.address], stdout=subprocess.PIPE)
        try:
            wait(lambda: bool(server.tabs))
            (tab,) = server.tabs.values()
            wait(lambda: tab.project is not None and tab.project.result is not None)
            _tell_playing(tab)
            _tell_mesh(tab)
            _tell_timeline(tab, "10 s")
            tab.events.run(lambda: tab.open(long))
            assert tab.project
            tab.project.solver.wait()
            time.sleep(SETTLED_S)
            _tell_timeline(tab, "10 min")
        finally:
            reader.terminate()
            server.close()


def _tell_playing(tab: Tab) -> None:
    """Print what two humanoids that play cost."""
    tab.playback.play(True)
    time.sleep(SETTLED_S)
    begin, drawn = process_time(), time.monotonic()
    time.sleep(PLAYED_S)
    share = (process_time() - begin) / (time.monotonic() - drawn)
    tab.playback.play(False)
    print(f"playing two humanoids: {share:.2f} of a core", flush=True)


def _tell_mesh(tab: Tab) -> None:
    """Print what a pose of two humanoids and of two meshes costs, and the first sight of the meshes."""
    costs = {}
    for figure in (HUMANOID, MESH):
        begin = process_time()
        tab.options.figure = figure
        tab.refresh()
        time.sleep(SETTLED_S)  # in which it is sent, too; else nothing is done
        shown = process_time() - begin
        with tab.events.lock:
            tab._stage.draw(0.0)  # places of all bones are found with the first pose
            begin = process_time()
            for frame in range(DRAWN):
                with tab.client.atomic():
                    tab._stage.draw(frame / 60.0)
            costs[figure] = (process_time() - begin) / DRAWN
        print(f"{figure}: {1e3 * costs[figure]:.2f} ms to pose two, {shown:.2f} s to show them", flush=True)
    bones = len(tab._stage._meshes[0].node.bones)
    print(f"a mesh of {bones} bones costs {costs[MESH] / costs[HUMANOID]:.1f} times as much as a humanoid", flush=True)


def _tell_timeline(tab: Tab, name: str) -> None:
    """Print what another page of the timeline costs."""
    with tab.events.lock:
        begin = process_time()
        for _ in range(PAGES):
            tab._timeline._page(force=True)
        print(f"another page of the timeline of {name}: {1e3 * (process_time() - begin) / PAGES:.1f} ms", flush=True)


def _read_with_mesh(path: Path, reading: ReadingOptions | None) -> Bvh:
    """Return a clip with a mesh of ``MESH_VERTICES`` vertices, as many at each joint."""
    bvh = skinned(read_performer_file(path, reading))
    mesh = bvh.stated.mesh
    assert mesh
    times = -(-MESH_VERTICES // len(mesh.vertices))
    rng = np.random.default_rng(0)
    vertices = np.repeat(mesh.vertices, times, axis=0) + rng.normal(scale=1e-3, size=(len(mesh.vertices) * times, 3))
    faces = np.arange(len(vertices) // 3 * 3).reshape(-1, 3)
    joints, weights = (np.repeat(table, times, axis=0) for table in (mesh.joints, mesh.weights))
    many = replace(mesh, vertices=vertices, faces=faces, joints=joints, weights=weights)
    return replace(bvh, stated=replace(bvh.stated, mesh=many))


def _read(address: str) -> None:
    """Read what a page sends to a tab, and print how much it is while it plays."""
    with open_tab(address) as tab:
        second, size = int(time.monotonic()), 0
        try:
            while True:
                size += len(tab.recv())
                if int(time.monotonic()) != second:
                    print(f"{size / 1e3:.0f} kB/s", file=sys.stderr, flush=True)
                    second, size = int(time.monotonic()), 0
        except ConnectionClosed:
            return


if __name__ == "__main__":
    if sys.argv[1] == "--read":
        _read(sys.argv[2])
    else:
        main(Path(sys.argv[1]))
