"""Pages that need no network: the room where templates of reports and studies are filled in."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup
from plotly.offline import get_plotlyjs


def render_page(template: str, filters: dict[str, Callable[..., Any]], **values: Any) -> str:
    """Return a page as HTML.

    Args:
        template: Name of a template beside this file.
        filters: What the template can do with values beside ``spread``, ``number`` and ``figure``.
        values: What the template speaks of.
    """
    environment = Environment(
        loader=FileSystemLoader(Path(__file__).parent), autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    environment.filters |= {"spread": spread, "number": number, "figure": _figure, **filters}
    return environment.get_template(template).render(plotly_js=Markup(get_plotlyjs()), **values)


def number(value: float | None, decimals: int) -> str:
    """Return a number with so many decimals and a true minus; a dash for none."""
    return "–" if value is None else f"{value:.{decimals}f}".replace("-", "−")  # noqa: RUF001 (typography)


def spread(summary: dict[str, float] | None, decimals: int) -> str:
    """Return mean ± standard deviation; a dash for none."""
    return "–" if not summary else f"{number(summary['mean'], decimals)} ± {number(summary['std'], decimals)}"  # noqa: RUF001


def _figure(figure: dict[str, Any]) -> Markup:
    """Return a figure as JSON that is safe inside a script."""
    return Markup(json.dumps(figure, allow_nan=False).replace("<", "\\u003c"))
