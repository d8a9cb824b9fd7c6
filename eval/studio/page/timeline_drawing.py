"""Drawings of the timeline as HTML: bars of the feet, trust, seams and spans, under the sliders that move them.

Nothing in them takes the mouse, so that the sliders below them do. Positions are shares of the window.
"""

from html import escape

import numpy as np

from datasets.motion.clip import FPS
from eval.clean.edits import FEET
from eval.clean.result import CleaningResult
from eval.studio.state.contact_bars import ContactTrack
from eval.studio.state.playback import Playback
from eval.studio.state.timeline_window import Window
from eval.viewer.colours import AFTER, FOOT_COLOURS, UNSURE, in_css

LABEL_EM = 7.25  # width of the labels at the left of viser's inputs
_EDGE = "calc(0.1em + 10px)"  # of viser's inputs at the right, and left of their label
TRACK_LEFT = f"calc({LABEL_EM}em + 0.1em + 10px)"
ROW_PX = 28  # height of a slider's row
TRUST_PX = 34
_MAX_POINTS = 600  # of a curve
_GREY = "#8a8f98"
TIMES = "\N{MULTIPLICATION SIGN}"


def trust_drawing(result: CleaningResult | None, window: Window, start_s: float) -> str:
    """Return the row of trust, with seams and spans behind it.

    Args:
        result: Result of cleaning, None before the first.
        window: Span that is shown.
        start_s: Time of the clip's first frame [s].
    """
    inside = ""
    if result is not None:
        fps = result.before.fps
        off_feet = [(result.start_s + span.start / fps, result.start_s + span.stop / fps) for span in result.off_feet]
        spans = [
            *((span, "#dde1e7", "off the feet") for span in off_feet),
            *((span, "#cfd4db", "kept as recorded") for span in result.kept_spans),
            *((span, "#f2dfb8", "physics is to be done: press Clean") for span in result.stale),
        ]
        inside += "".join(_span(window, *span, colour, title) for span, colour, title in spans)
        inside += f'<svg viewBox="0 0 1 1" preserveAspectRatio="none" style="{_FILL}">{_curve(result, window, start_s)}</svg>'
        inside += "".join(_tick(window, time) for time in result.restarts if 0.0 <= window.share(time) <= 1.0)
    return _row("Trust", inside, TRUST_PX)


_FILL = "position:absolute;inset:0;width:100%;height:100%"


def foot_drawing(track: ContactTrack | None, foot: str, window: Window) -> str:
    """Return the bars of a foot, which lie on the slider below this."""
    colour, bars = in_css(FOOT_COLOURS[FEET.index(foot)]), ""
    start_s = track.start_s if track else 0.0
    for bar in track.bars(foot) if track else ():
        first, last = (np.clip(window.share(start_s + frame / FPS), 0.0, 1.0) for frame in (bar.start, bar.stop))
        if first < last:
            bars += (
                f'<div style="position:absolute;left:{100 * first:.3f}%;width:{100 * (last - first):.3f}%;top:4px;height:11px;'
                f'background:{colour};opacity:0.75;border-radius:3px"></div>'
            )
    return _over(bars, ROW_PX)


def playhead_drawing(playback: Playback, window: Window, height_px: int) -> str:
    """Return the line through all rows at the time that is shown."""
    share = window.share(playback.time_s)
    place = f"left:{100 * share:.3f}%;top:0;width:2px;margin-left:-1px;height:{height_px}px"
    line = f'<div style="position:absolute;{place};background:#d63e3e"></div>'
    return _over(line if 0.0 <= share <= 1.0 else "", height_px)


def readout(playback: Playback, window: Window) -> str:
    """Return the line that says which time and frame is shown, how fast, and of which part of the clip."""
    parts = [
        f'<b style="font-variant-numeric:tabular-nums">{playback.time_s:.3f} s</b>',
        f"frame {playback.frame + 1} of {playback.num_frames}",
        f"{playback.speed:g}{TIMES}",
        "looped" if playback.is_looped else "once",
    ]
    whole = window.start_s <= playback.start_s and playback.stop_s <= window.stop_s + 1e-6
    shown = "" if whole else f"timeline: {window.start_s:.1f} to {window.stop_s:.1f} s of {playback.stop_s:.1f} s"
    return (
        f'<div style="display:flex;justify-content:space-between;padding:0 10px 4px 10px;font-size:0.85em;color:#555">'
        f"<span>{' · '.join(parts)}</span><span>{escape(shown)}</span></div>"
    )


def _row(label: str, inside: str, height_px: int) -> str:
    """Return a row like viser's inputs: a label, and a track with drawings in it."""
    return (
        f'<div style="display:flex;padding:0 10px 2px 10px;align-items:center"><div style="width:{LABEL_EM}em;flex-shrink:0">'
        f'<span style="font-size:0.875em;font-weight:450;letter-spacing:-0.75px;opacity:0.6">{label}</span></div>'
        f'<div style="position:relative;flex-grow:1;height:{height_px}px;margin:0 0.1em;background:rgba(128,136,148,0.10)">'
        f"{inside}</div></div>"
    )


def _over(inside: str, height_px: int) -> str:
    """Return drawings that take no room and lie over the tracks of the rows below them."""
    return (
        f'<div style="position:relative;height:0;pointer-events:none;z-index:2"><div style="position:absolute;left:{TRACK_LEFT};'
        f'right:{_EDGE};top:0;height:{height_px}px">{inside}</div></div>'
    )


def _span(window: Window, start_s: float, stop_s: float, colour: str, title: str) -> str:
    first, last = (float(np.clip(window.share(time), 0.0, 1.0)) for time in (start_s, stop_s))
    if first >= last:
        return ""
    return (
        f'<div title="{escape(title)}" style="position:absolute;left:{100 * first:.3f}%;width:{100 * (last - first):.3f}%;top:0;bottom:0;'
        f'background:{colour};overflow:hidden;white-space:nowrap;font-size:0.75em;color:#5c6570;line-height:{TRUST_PX}px;padding-left:6px">'
        f"{escape(title)}</div>"
    )


def _tick(window: Window, time_s: float) -> str:
    return (
        f'<div title="restart at {time_s:.2f} s" style="position:absolute;left:{100 * window.share(time_s):.3f}%;top:0;bottom:0;width:0;'
        f'border-left:1.5px dashed {_GREY}"></div>'
    )


def _curve(result: CleaningResult, window: Window, start_s: float) -> str:
    """Return the trust as a filled curve, in the figure's colour where it is high."""
    fps = result.before.fps
    first, last = (int(np.clip(round((time - start_s) * fps), 0, len(result.confidence) - 1)) for time in window)
    frames = np.unique(np.linspace(first, last, min(_MAX_POINTS, last - first + 1)).astype(int))
    points = [f"{window.share(start_s + frame / fps):.4f},{1.0 - 0.94 * result.confidence[frame]:.3f}" for frame in frames]
    left, right = points[0].split(",")[0], points[-1].split(",")[0]
    fill = in_css(AFTER) if result.confidence[first : last + 1].mean() > 0.5 else in_css(UNSURE)
    return f'<polygon points="{left},1 {" ".join(points)} {right},1" fill="{fill}" fill-opacity="0.45"/>'
