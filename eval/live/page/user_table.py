"""Table of the users, as HTML."""

from collections.abc import Mapping
from html import escape

from eval.live.messages import CALIBRATING, STATES, UserView
from eval.live.page.crowd import T_POSE
from eval.viewer.colours import FOOT_COLOURS, in_css, user_colour

_CELL = "padding:3px 0 3px 8px;text-align:right"


def user_table(views: Mapping[int, UserView]) -> str:
    """Return how many users there are, who must stand in a T-pose, and a row for each user.

    Args:
        views: Last frame of each user, by user number.
    """
    count = f"{len(views)} user{'s' * (len(views) != 1)}" if views else "nobody is here yet"
    posing = [escape(view.name) for view in views.values() if view.state == STATES[CALIBRATING]]
    told = f"<p style='margin:4px 0'><b>{', '.join(posing)}: {T_POSE}</b></p>" if posing else ""
    head = "".join(f"<th style='{_CELL};font-weight:400;opacity:.7'>{word}</th>" for word in ("state", "stands", "fps", "ms"))
    rows = "".join(_row(user, view) for user, view in views.items())
    table = f"<table style='width:100%;border-collapse:collapse'><tr><th></th>{head}</tr>{rows}</table>" if views else ""
    return f"<div style='padding:0 10px 8px;font-size:13px;font-variant-numeric:tabular-nums'><b>{count}</b>{told}{table}</div>"


def _row(user: int, view: UserView) -> str:
    """Return a user's row; the name is the client's own, so it is escaped."""
    dot = f"<span style='color:{in_css(user_colour(user))}'>●</span>"
    cells = (view.state, _feet(view), f"{view.fps:.1f}" if view.fps else "", f"{view.latency_ms:.1f}")
    name = f"<td style='overflow-wrap:anywhere'>{dot} {escape(view.name)}</td>"
    return f"<tr>{name}{''.join(f'<td style={_CELL!r}>{cell}</td>' for cell in cells)}</tr>"


def _feet(view: UserView) -> str:
    """Return a letter for each foot, on its colour while it stands."""
    letters = []
    for letter, stands, colour in zip("LR", view.contacts, FOOT_COLOURS, strict=True):
        look = f"background:{in_css(colour)};color:#fff" if stands else "opacity:.5"
        letters.append(f"<span style='padding:0 4px;margin-left:3px;border-radius:3px;{look}'>{letter}</span>")
    return "".join(letters)
