"""Table of the users."""

import re

from eval.live.page.user_table import user_table
from tests.eval.live.page_parts import seen


def words(html: str) -> list[str]:
    """Return what is read on the page."""
    return [word for word in re.split(r"<[^>]*>", html) if word.strip()]


def test_nobody() -> None:
    assert words(user_table({})) == ["nobody is here yet"]


def test_a_row_for_each_user_and_names_are_no_markup() -> None:
    html = user_table({1: seen(), 4: seen(state="calibrating", name="user 4 (<b>&'\")")})
    told = words(html)
    name = "user 4 (&lt;b&gt;&amp;&#x27;&quot;)"
    assert told[:2] == ["2 users", f"{name}: stand in a T-pose, arms straight out"]
    assert told[2:6] == ["state", "stands", "fps", "ms"]
    assert told[6:] == ["●", " user 1 (Ann)", "live", "L", "R", "44.9", "1.2", "●", f" {name}", "calibrating", "L", "R", "44.9", "1.2"]
