"""The page in a real browser: a figure that comes, with a foot that stands."""

import io
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from PIL import Image

from eval.live.page.live_page import LivePage
from tests.eval.browser import Browser, browser
from tests.eval.live.page_parts import seen

PANEL_PX, SECONDS = 360, 60.0
WINDOW_PX = (760, 500)


def scene(view: Browser) -> np.ndarray:
    """Return the pixels left of the panel and below the browser's warning of a slow graphics card, (H, W, 3)."""
    return np.asarray(Image.open(io.BytesIO(view.screenshot())).convert("RGB"), dtype=float)[160:, :-PANEL_PX]


def until(view: Browser, holds: Callable[[np.ndarray], bool]) -> None:
    """Wait until the scene is as it should be; software draws it slowly."""
    end = time.monotonic() + SECONDS
    while not holds(scene(view)):
        assert time.monotonic() < end
        time.sleep(0.1)


def is_blue(pixels: np.ndarray) -> np.ndarray:
    return (pixels[..., 2] > pixels[..., 0] + 60) & (pixels[..., 2] > pixels[..., 1] + 25)


def is_orange(pixels: np.ndarray) -> np.ndarray:
    return (pixels[..., 0] > pixels[..., 2] + 60) & (pixels[..., 0] > pixels[..., 1] + 25)


def test_a_figure_is_seen(tmp_path: Path) -> None:
    page = LivePage(0)
    try:
        with browser(tmp_path / "profile", WINDOW_PX) as view:
            view.open(f"{page.address}?fixedDpr=0.25")
            view.until("document.body.innerText.includes('nobody is here yet')")
            page.show({})
            assert not is_blue(scene(view)).any()
            time.sleep(0.2)  # until the table may change again
            page.show({1: seen()})
            view.until("document.body.innerText.includes('user 1 (Ann)')")
            # a T-pose covers some percent of the scene, its left foot a thousandth
            until(view, lambda pixels: 0.01 < is_blue(pixels).mean() < 0.3 and 0.0003 < is_orange(pixels).mean() < 0.02)
            page.show({})
            until(view, lambda pixels: not is_blue(pixels).any())
    finally:
        page.close()
