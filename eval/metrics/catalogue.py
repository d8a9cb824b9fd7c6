"""Catalogue of the metrics that reports and studies print: unit, decimals, whether higher or lower is better, and a short text."""

from typing import NamedTuple


class Metric(NamedTuple):
    """Description of a metric.

    Attributes:
        unit: Unit of its values.
        decimals: Number of decimals printed.
        better: "higher" or "lower".
        text: Short definition; docs/metrics.md has the whole one.
    """

    unit: str
    decimals: int
    better: str
    text: str


TRACKING_CATALOGUE = {
    "episode_length_ratio": Metric("ratio", 3, "higher", "how much of the reference the agent lasts"),
    "sr90": Metric("ratio", 3, "higher", "share of rollouts that last at least 0.9 of it"),
    "upright_ratio": Metric("ratio", 3, "higher", "how much of it the pelvis stays at its height and tilt, wherever it drifts"),
    "max_reward_ratio": Metric("ratio", 3, "higher", "reward gathered, of the most possible"),
    "root_mse": Metric("m²", 4, "lower", "squared distance of the root from the reference's, while it lasts"),
    "body_error": Metric("mm", 1, "lower", "distance of the bodies from the reference's, roots aligned, while it lasts"),
    "root_mse_truth": Metric("m²", 4, "lower", "the same from the clean clip behind the faulty one"),
}
ARTEFACT_CATALOGUE = {
    "stance_skate": Metric("cm/s", 2, "lower", "horizontal speed of feet while they stand"),
    "foot_skate": Metric("cm/s", 2, "lower", "horizontal speed of feet under 2 cm, swinging ones too"),
    "skating_ratio": Metric("ratio", 3, "lower", "frames with a low foot faster than 0.5 m/s"),
    "floating": Metric("mm", 2, "lower", "height of the lowest point above the ground"),
    "ground_penetration": Metric("mm", 2, "lower", "depth of the lowest point under the ground"),
    "self_penetration": Metric("ratio", 3, "lower", "frames with limbs through each other"),
    "self_penetration_depth": Metric("mm", 2, "lower", "how deep"),
    "jitter": Metric("km/s³", 3, "lower", "third difference of the joints' positions"),
    "imbalance": Metric("ratio", 3, "lower", "contact frames with the centre of mass beside the feet"),
    "deviation_local": Metric("mm", 1, "lower", "how far joints were moved, roots aligned"),
    "deviation_world": Metric("mm", 1, "lower", "how far joints were moved, in the world"),
    "truth_error_local": Metric("mm", 1, "lower", "distance to the clean clip, roots aligned"),
    "truth_error_world": Metric("mm", 1, "lower", "distance to the clean clip, in the world"),
    "contact_agreement": Metric("ratio", 3, "higher", "frames and feet that stand, or not, as in the clean clip"),
    "touchdown_error": Metric("ms", 0, "lower", "distance in time of its touch-downs from the nearest ones"),
}


def metrics_with_values(*sides: dict[str, float]) -> dict[str, Metric]:
    """Return the artefact metrics of which any side has a value, by id."""
    return {name: metric for name, metric in ARTEFACT_CATALOGUE.items() if any(name in side for side in sides)}
