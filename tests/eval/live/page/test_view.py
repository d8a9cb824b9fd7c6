"""Where the page looks."""

from collections.abc import Iterator

import numpy as np
import pytest
import viser

from eval.live.page.view import View
from eval.viewer.server import open_server
from tests.eval.viewer.viewer_parts import open_tab, wait


@pytest.fixture
def viewer() -> Iterator[viser.ViserServer]:
    """Yield a server."""
    made = open_server(0)
    yield made
    made.stop()


def distance(viewer: viser.ViserServer) -> float:
    """Return how far new tabs look from [m]."""
    camera = viewer.initial_camera
    return float(np.linalg.norm(np.subtract(camera.position, camera.look_at)))


def test_the_ground_moves_below_who_walks(viewer: viser.ViserServer) -> None:
    view = View(viewer)
    view.follow(np.array([[2.3, 0.0, 0.9]]))
    assert view._world.position == pytest.approx([-2.3, 0.0, 0.0])
    assert view._ground.position == pytest.approx([2.0, 0.0, 0.0])  # by whole metres
    view.follow(np.array([[3.3, 0.0, 0.9]]))
    assert view._world.position == pytest.approx([-2.3 - 0.12 * 1.0, 0.0, 0.0])  # 12 % of the way in a frame
    view.follow(np.array([[3.3, 9.0, 0.9]]))
    assert view._world.position == pytest.approx([-3.3, -9.0, 0.0])  # too far to go after
    view.follow(np.zeros((0, 3)))
    assert view._world.position == pytest.approx([-3.3, -9.0, 0.0])


def test_cameras_are_as_far_as_the_users_need(viewer: viser.ViserServer) -> None:
    view = View(viewer)
    view.follow(np.array([[0.0, 0.0, 0.9]]))
    assert distance(viewer) == pytest.approx(4.3)
    with open_tab(f"http://127.0.0.1:{viewer.get_port()}"):
        wait(lambda: bool(viewer.get_clients()))
        (client,) = viewer.get_clients().values()
        view.follow(np.array([[0.0, -2.0, 0.9], [0.0, 2.0, 0.9]]))
        assert distance(viewer) == pytest.approx(4.3 + 2.0 * 2.0)
        assert client.camera.position == pytest.approx(np.full(3, 3.0 * 8.3 / 4.3))  # from (3, 3, 3), where the tab looks from
        assert client.camera.look_at == pytest.approx(np.zeros(3))
        view.follow(np.array([[0.0, -2.1, 0.9], [0.0, 2.1, 0.9]]))
        assert distance(viewer) == pytest.approx(8.3)  # little changes leave it alone
