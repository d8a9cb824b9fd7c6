"""Rendering of the HTML pages of reports and studies, which need no network, from their templates."""

import base64
import json
from collections.abc import Callable
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup
from plotly.offline import get_plotlyjs

from configs.source_code import PROJECT_ROOT


def render_page(template: str, filters: dict[str, Callable[..., Any]], **values: Any) -> str:
    """Return a page as HTML.

    Args:
        template: Path of a template below ``eval/``.
        filters: Filters of the template beside this file's, by name.
        **values: Variables of the template, by name.
    """
    environment = Environment(
        loader=FileSystemLoader(PROJECT_ROOT / "eval"), autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    own = {"spread": spread, "number": number, "change": change, "figure": _figure, "video": _video, "image": _image}
    environment.filters |= {**own, **filters}
    return environment.get_template(template).render(plotly_js=Markup(get_plotlyjs()), **values)


def number(value: float | None, decimals: int) -> str:
    """Return a number with so many decimals and a typographic minus; a dash for None."""
    return "–" if value is None else f"{value:.{decimals}f}".replace("-", "−")  # noqa: RUF001 (typography)


def spread(summary: dict[str, float] | None, decimals: int) -> str:
    """Return mean ± standard deviation; a dash for None."""
    return "–" if not summary else f"{number(summary['mean'], decimals)} ± {number(summary['std'], decimals)}"  # noqa: RUF001


def change(before: float | None, after: float | None, decimals: int) -> str:
    """Return the change of a value that is printed with so many decimals, in per cent; the new value if it was zero."""
    if before is None or after is None:
        return "–"  # noqa: RUF001
    first, second = round(before, decimals), round(after, decimals)
    if first == second:
        return "0 %"
    sign = "+" if second > first else ""
    return sign + (f"{number(100.0 * (after - before) / before, 0)} %" if first else number(second, decimals))


def _figure(figure: dict[str, Any]) -> Markup:
    """Return a figure as JSON that is safe inside a script element."""
    return Markup(json.dumps(figure, allow_nan=False).replace("<", "\\u003c"))


def _video(mp4: bytes) -> str:
    """Return a video as a data URL."""
    return "data:video/mp4;base64," + base64.b64encode(mp4).decode()


def _image(png: bytes) -> str:
    """Return a picture as a data URL."""
    return "data:image/png;base64," + base64.b64encode(png).decode()
