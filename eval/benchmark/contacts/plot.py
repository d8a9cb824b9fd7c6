"""Plot of ground contact: slip and depth against the engine's time step, and slip by kind of motion."""

from collections.abc import Mapping, Sequence
from io import BytesIO

from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from eval.benchmark.contacts.measurement import MIN_SLIP_SPEED_M_S, GroundContact

_STYLE = {"held": ("tab:grey", "root held, no policy"), "policy": ("tab:blue", "the package's policy")}


def draw_contacts(
    steps: Mapping[float, Mapping[str, GroundContact]], kinds: Mapping[str, Mapping[str, GroundContact]], compared: Sequence[str]
) -> bytes:
    """Return the plot as PNG.

    Args:
        steps: Measures "held" and by "policy", by the engine's time step [s].
        kinds: Measures by the policy, by model and kind of motion.
        compared: Two models whose kinds are drawn beside each other.
    """
    figure = Figure(figsize=(13, 4.2), layout="constrained")
    FigureCanvasAgg(figure)
    slip, depth, by_kind = figure.subplots(1, 3)
    _against_step(slip, steps, "slip", "slip, weighed by load [cm/s]")
    _against_step(depth, steps, "depth_p99", "depth, 99th percentile [mm]")
    names = list(kinds[compared[0]])
    width = 0.8 / len(compared)
    for place, (model, colour) in enumerate(zip(compared, ("tab:orange", "tab:blue"), strict=True)):
        where = [at + width * (place - 0.5 * (len(compared) - 1)) for at in range(len(names))]
        by_kind.bar(where, [kinds[model][name].slip for name in names], width, label=model, color=colour)
    by_kind.set_xticks(range(len(names)), names)
    by_kind.set(ylabel="slip, weighed by load [cm/s]", title="the package's policy, by kind of motion")
    by_kind.axhline(100.0 * MIN_SLIP_SPEED_M_S, color="black", linewidth=0.5, linestyle=":")
    by_kind.legend()
    png = BytesIO()
    figure.savefig(png, dpi=80, format="png")
    return png.getvalue()


def _against_step(axes: Axes, steps: Mapping[float, Mapping[str, GroundContact]], name: str, title: str) -> None:
    """Draw a measure against the time step, the finest on the right."""
    rates = sorted(steps, reverse=True)
    for mode, (colour, label) in _STYLE.items():
        axes.plot([1.0 / step for step in rates], [getattr(steps[step][mode], name) for step in rates], "o-", color=colour, label=label)
    axes.set_xscale("log")
    axes.set_xticks([1.0 / step for step in rates], [f"1/{round(1.0 / step)}" for step in rates])
    axes.minorticks_off()
    axes.set(xlabel="time step [s]", ylabel=title, ylim=(0.0, None))
    axes.legend()
