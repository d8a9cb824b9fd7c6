"""Figures of users: where their bodies are, which colours they have, who comes and goes."""

from collections.abc import Iterator

import numpy as np
import pytest

from datasets.motion.humanoid import BODY_NAMES
from eval.live.page.crowd import body_colours, body_places, label_text
from eval.live.page.live_page import DRAW_INTERVAL_S, LivePage
from eval.viewer.colours import FOOT_COLOURS, LEFT_FOOT, RIGHT_FOOT, in_linear, user_colour
from tests.eval.live.page_parts import PELVIS_HEIGHT_M, seen
from tests.eval.viewer.viewer_parts import open_tab, wait

HEAD, FOREARM, FOOT, TOE = (BODY_NAMES.index(name) for name in ("head", "forearm_l", "foot_r", "toe_l"))


@pytest.fixture
def page() -> Iterator[LivePage]:
    """Yield a page that nobody is on."""
    made = LivePage(0)
    yield made
    made.close()


def test_bodies_are_where_the_pose_has_them_at_the_users_size() -> None:
    turned = seen(1.0, 2.0, scale=1.25)
    turned.rotations[0] = [np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5)]  # a quarter to the left: who looked along x looks along y
    positions, rotations = body_places([seen(), turned])
    # a trunk of 0.10 + 0.17 + 0.27 m; a collar at 0.10 + 0.17 + 0.20 m, 0.03 m aside, 0.15 m to the arm and 0.28 m to the elbow
    assert positions[0, HEAD] == pytest.approx([0.0, 0.0, PELVIS_HEIGHT_M + 0.54])
    assert positions[0, FOREARM] == pytest.approx([0.0, 0.46, PELVIS_HEIGHT_M + 0.47])
    assert positions[1, HEAD] == pytest.approx([1.0, 2.0, 1.25 * (PELVIS_HEIGHT_M + 0.54)])
    assert positions[1, FOREARM] == pytest.approx([1.0 - 1.25 * 0.46, 2.0, 1.25 * (PELVIS_HEIGHT_M + 0.47)])
    assert np.allclose(rotations[1], turned.rotations[0])


def test_feet_that_stand_are_coloured_and_who_is_not_live_is_pale() -> None:
    left, both = body_colours(1, seen()), body_colours(2, seen(contacts=(True, True), state="warming up"))
    assert (left[TOE], left[FOOT], left[HEAD]) == (LEFT_FOOT, user_colour(1), user_colour(1))
    assert (both[TOE], both[FOOT]) == (LEFT_FOOT, RIGHT_FOOT)
    assert both[HEAD] != user_colour(2)
    assert sum(colour in FOOT_COLOURS for colour in both) == 4


def test_labels_tell_name_state_and_what_to_do() -> None:
    assert label_text(seen()) == "user 1 (Ann): live"
    assert label_text(seen(state="calibrating")) == "user 1 (Ann): calibrating; stand in a T-pose, arms straight out"


def test_users_come_and_go(page: LivePage) -> None:
    page.show({3: seen(0.5)})
    assert list(page.crowd.labels) == [3]
    assert page.crowd.labels[3].position == pytest.approx([0.5, 0.0, PELVIS_HEIGHT_M + 0.54 + 0.4])
    page.show({3: seen(0.5), 5: seen(2.0, scale=1.25)})
    assert list(page.crowd.labels) == [3, 5]
    head = page.crowd.nodes[HEAD]
    assert head.batched_positions == pytest.approx(np.array([[0.5, 0.0, 1.49], [2.0, 0.0, 1.25 * 1.49]]))
    assert head.batched_scales == pytest.approx([1.0, 1.25])
    assert np.array_equal(head.batched_colors, in_linear(np.array([user_colour(3), user_colour(5)])))
    page.show({5: seen(2.0)})
    assert list(page.crowd.labels) == [5]
    assert page.crowd.nodes[HEAD].batched_positions.shape == (1, 3)
    page.show({})
    assert (page.crowd.nodes, page.crowd.labels) == ([], {})
    page.show({6: seen()})
    assert len(page.crowd.nodes) == 20


def test_the_page_is_drawn_seldom_while_nobody_looks(page: LivePage, monkeypatch: pytest.MonkeyPatch) -> None:
    waits: list[float] = []
    monkeypatch.setattr(page._came, "wait", waits.append)
    page.show({})
    page.wait()
    assert waits == [pytest.approx(1.0, abs=0.1)]
    monkeypatch.undo()
    with open_tab(page.address):
        wait(lambda: bool(page.viewer.get_clients()))
        monkeypatch.setattr("eval.live.page.live_page.time.sleep", waits.append)
        page.show({})
        page.wait()
    assert waits[1] == pytest.approx(DRAW_INTERVAL_S, abs=0.02)
