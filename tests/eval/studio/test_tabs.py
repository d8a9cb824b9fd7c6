"""Tabs: each has its own time and view, all share the clip and its edits, and none takes anything along as it closes."""

from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest
import viser

from datasets.motion.humanoid import BODY_NAMES
from eval.clean.edits import LEFT, ContactEdit, Edits
from eval.studio.page.view_panel import ViewPanel
from eval.studio.state.view_options import FIGURES, GHOST, HUMANOID, MESH, SIDE_BY_SIDE
from eval.studio.studio_server import StudioServer
from tests.datasets.formats.blender_scenes import hide_blender, without_blender
from tests.eval.studio.open_tab import tab
from tests.eval.studio.studio_parts import dress_clips, workspace, write_clip
from tests.eval.viewer.viewer_parts import wait

MESH_NODE = "/world/before mesh/skin"


@pytest.fixture
def studio(tmp_path: Path) -> Iterator[StudioServer]:
    """Yield a studio that shows a clip."""
    with workspace(write_clip(tmp_path), tmp_path / "kept") as opened:
        server = StudioServer(opened, 0)
        yield server
        server.close()


def test_two_tabs_do_not_disturb_each_other(studio: StudioServer) -> None:
    with ExitStack() as tabs:
        one, other = (tabs.enter_context(tab(studio)) for _ in range(2))
        assert one.project is other.project
        one.options.comparison = GHOST
        one.seek(1.0)
        one.playback.play(True)
        wait(lambda: one.playback.time_s > 1.1)
        assert (other.playback.time_s, other.playback.is_playing, other.options.comparison) == (0.0, False, SIDE_BY_SIDE)


def test_a_closed_tab_loses_nothing(studio: StudioServer) -> None:
    edits = Edits(contacts=(ContactEdit(LEFT, 0.5, 1.0, False),))
    with tab(studio) as first:
        assert first.project
        first.project.change(edits)
    with tab(studio) as second:
        assert second.project is first.project
        assert second.project
        assert second.project.edits == edits
        second.project.solver.wait()
        assert second.project.result
        assert not second.project.result.contacts[30:60, 0].any()


@without_blender
def test_without_blender_only_what_can_be_written_is_offered_and_a_line_says_why(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    hide_blender(tmp_path, monkeypatch)
    with workspace(write_clip(tmp_path), tmp_path / "kept") as opened:
        server = StudioServer(opened, 0)
        with tab(server) as shown:
            wait(lambda: shown._save._missing.visible)
            assert shown._save._format.options == ("BVH",)
            assert "FBX and glTF are read and written by Blender" in shown._save._missing.content
            assert "pip install bpy==" in shown._save._missing.content
        server.close()


def test_a_problem_is_one_line_on_the_page_and_the_tab_goes_on(studio: StudioServer, capsys: pytest.CaptureFixture[str]) -> None:
    told: list[str] = []
    with tab(studio) as shown:
        events = shown.events
        events.tell_problem = told.append
        events.run(lambda: shown.receive("evil.bvh", b"no motion"))
        events.run(lambda: shown.receive("evil.exe", b"no motion"))
        events.run(lambda: 1 / 0)  # type: ignore[arg-type]
        assert [line.split(":")[0].split(",")[0] for line in told] == ["evil.bvh", "evil.exe", "That did not work"]
        assert shown.project
        assert shown.project.name == "sway"
    assert "ZeroDivisionError" in capsys.readouterr().err


def test_a_mesh_is_a_figure_where_the_file_has_one(studio: StudioServer, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    told = "The file's mesh is not drawn: it is made of holes."
    dress_clips(monkeypatch, "dressed.bvh", told)
    with tab(studio) as shown:
        panel, scene = ViewPanel(shown.client.gui, shown), shown.client.scene
        panel.refresh()
        assert panel.figure.options == FIGURES  # of a clip without a mesh
        shown.open(write_clip(tmp_path, "dressed.bvh"))
        panel.refresh()
        assert panel.figure.options == (*FIGURES, MESH)
        shown.options.figure = panel.figure.value = MESH
        shown.refresh()
        wait(lambda: isinstance(scene.get_handle_by_name(MESH_NODE), viser.MeshSkinnedHandle))
        mesh = scene.get_handle_by_name(MESH_NODE)
        assert isinstance(mesh, viser.MeshSkinnedHandle)
        assert len(mesh.bones) == len(BODY_NAMES)
        wait(lambda: mesh.bones[0].position[2] > 0.8)  # m, of the pelvis, which is at the file's origin at rest
        shown.open(write_clip(tmp_path, "bare.bvh"))
        panel.refresh()
        assert (panel.figure.options, panel.figure.value, shown.options.figure) == (FIGURES, HUMANOID, HUMANOID)
        wait(lambda: scene.get_handle_by_name(MESH_NODE) is None)
        assert shown.project
        assert shown.project.session.bvh.stated.no_mesh == panel.left_out.content == told
