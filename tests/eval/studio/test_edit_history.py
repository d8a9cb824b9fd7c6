"""Undo and redo."""

from eval.clean.edits import Edits
from eval.studio.state.edit_history import MAX_UNDONE, EditHistory


def test_undo_and_redo_go_back_and_forth() -> None:
    history = EditHistory()
    assert not history.undo()
    assert history.change(Edits(ground_m=0.1))
    assert history.change(Edits(ground_m=0.2))
    assert not history.change(Edits(ground_m=0.2))
    assert history.undo()
    assert history.present.ground_m == 0.1
    assert history.undo()
    assert history.present == Edits()
    assert history.redo()
    assert history.redo()
    assert history.present.ground_m == 0.2
    assert not history.redo()


def test_a_change_forgets_what_was_undone() -> None:
    history = EditHistory()
    history.change(Edits(ground_m=0.1))
    history.undo()
    history.change(Edits(ground_m=0.3))
    assert not history.redo()


def test_the_oldest_steps_are_forgotten() -> None:
    history = EditHistory()
    for step in range(MAX_UNDONE + 5):
        history.change(Edits(ground_m=step / 1000.0 + 0.001))
    assert len(history.earlier) == MAX_UNDONE
