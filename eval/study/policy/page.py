"""Pages of the policy studies: groups of measures, training curves, and notes for the reader."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict

from envs.mimic.spec import MimicSpec
from eval.evaluation_recordings import TRAIN_FOLDER
from eval.pages.figures import figure, line
from eval.runs.training_curves import Curve
from eval.study.framework.page import Group, Measure, Plot
from eval.study.policy.scores import MEASURES, RECORDED_PREFIX
from eval.study.policy.unseen_clips import UnseenClips
from eval.study.policy.variants import DRECON, FULL, IMU, IMU_LARGE, MIXED, OPTICAL, OPTICAL_LARGE, OURS
from trainers.algorithms.ppo_config import PpoConfig

COLOURS = {  # legible on white and on black
    MIXED: "#2f7dc8", OURS: "#2f7dc8", IMU_LARGE: "#d9541f", IMU: "#d9a51f", OPTICAL_LARGE: "#6b9e5b", OPTICAL: "#9a7fb8",
    DRECON: "#6b9e5b", FULL: "#d9541f",
}  # fmt: skip
_TABLE_4_4 = {
    "episode_length_ratio": Measure("ratio", "eq. 4.11: how long a rollout lasts, of its reference"),
    "sr90": Measure("ratio", "eq. 4.13: share of the rollouts that last at least 0.9 of their reference"),
    "root_mse": Measure("m²", "eq. 4.12, over the frames that a rollout lasts: whoever falls soon has had no time to drift"),
    "max_reward_ratio": Measure("ratio", "eq. 4.14 and 4.15: rewards gathered, of the most possible"),
    "episode_length_ratio_std": Measure("ratio", "standard deviation over rollouts, as in the table"),
    "root_mse_std": Measure("m²", "standard deviation over rollouts"),
    "max_reward_ratio_std": Measure("ratio", "standard deviation over rollouts, as in the table"),
}
GROUPS = (
    Group(
        "Table 4.4",
        "Clips of unseen performers through simulated suits, as the thesis tested on clips of IMU suits.",
        {**_TABLE_4_4, "root_mse_truth": Measure("m²", "the same against the root of the clip behind the suit's")},
    ),
    Group("The same clips as recorded", "Optical clips, as no row of Table 4.4 was tested.",
          {RECORDED_PREFIX + key: measure for key, measure in _TABLE_4_4.items()}),
    Group(
        "By folder",
        "cmu/test is long and varied, bandai/test are short walks, runs and dances.",
        {
            f"{before}{measure}_{source}": Measure("ratio", f"{'as recorded' if before else 'through suits'}, {source}")
            for source in ("cmu", "bandai")
            for before in ("", RECORDED_PREFIX)
            for measure in ("episode_length_ratio", "sr90")
        },
    ),
    Group("Trainings", "What each learnt from, and how long.", {
        "assets": Measure("", "recordings, those of simulated suits counted as recordings of their own"),
        "frames": Measure("", "of them, at 60 fps"),
        "samples": Measure("steps", "control steps of a training"),
        "minutes": Measure("min", "of one core that it took, evaluation on the held-out performer included"),
    }),
)  # fmt: skip


def policy_notes(config: PpoConfig, steps: int, seeds: int, held_out: str, tested: Sequence[UnseenClips]) -> tuple[str, ...]:
    """Return the notes for the reader.

    Args:
        config: Run configuration of the first training.
        steps: Control steps of each training.
        seeds: Trainings of each row.
        held_out: Performer whose clips select models.
        tested: Test clips.
    """
    windows = sum(len(set(one.rollouts.window.tolist())) for one in tested if one.through_suit)
    additions = [f"{key}={value}" for key, value in asdict(config.task).items() if value != getattr(MimicSpec(), key)]
    left_out = sorted({name for one in tested for name in one.too_short})
    return (
        f"Every training has {steps:,} control steps, whatever its row; every row has {seeds} seeds, which differ in the network, the "
        "actions and where episodes begin, not in data. The thesis trained each agent once, for 35,000 epochs of 65,536 steps, 2.3 "
        "billion, and reports the best epoch on its test clips: its values are a mark that cannot be reached here, what can be repeated "
        "is the order of the rows. So small a budget shows the beginning of a training: a row that is hardly above the zero "
        "residual, the last one, has learnt too little to tell.",
        "The task and the rewards are those of the thesis: what the policy sees is what it is rewarded for. In everything that does not "
        f"tell the rows apart, they have the settings of configs/mixed.yaml: networks of {list(config.network.hidden)}, a discount of "
        f"{config.learner.gamma:g}, and beyond the thesis, for all rows alike, {', '.join(additions)}: what learns from few samples.",
        f"Training clips are {TRAIN_FOLDER}, our own: nobody has the thesis's. Optical are the clips as recorded; IMU are simulated suits' "
        "recordings of the same clips, their roots by Root3D; no real IMU recording is among them. Large are all clips, the others a fixed "
        "half of their minutes. IMU + optical are both recordings of that half, drawn equally often: as many frames as either large set "
        "has, of half as many performances. (The thesis's two parts held different motions, together half as many frames as its large "
        "sets.) The configurations learn from IMU + optical, as in the thesis.",
        f"The policy that does best on {held_out}, who trains nobody, as recorded and through a suit, is the one that is tested. Tests are "
        f"the evaluation protocol with the mean action on cmu/test and bandai/test, performers whom no training saw: {windows} windows of "
        f"20 rollouts each, through a suit and as recorded. Left out as too short: {', '.join(left_out) or 'none'}.",
        "A finding counts as reproduced where two rows are further apart than their two standard deviations over seeds together, decided "
        "before any row was known. What is closer is undecided, and not reproduced. Its root MSE "
        "(5.1e-5 to 2.1e-4 'per frame in m') is not eq. 4.12, so that no value stands beside ours; what it lost of its first row's length "
        "ratio is above 0.961. What it saw in pictures, the blandness of the full action space, is not measured here.",
    )


def plot_training_curves(curves: Mapping[str, Sequence[Mapping[str, Curve]]]) -> list[Plot]:
    """Return training curves of the rows on the held-out performer, the mean over seeds (thesis figures 4.5 and 4.7).

    Args:
        curves: Training curves of each seed, by row.
    """
    plots = []
    for measure in MEASURES:
        lines = []
        for row, seeds in curves.items():
            points = [one[f"held_out/{measure}"] for one in seeds]
            values = [sum(at) / len(seeds) for at in zip(*(values for _, values in points), strict=True)]
            lines.append(line([samples / 1e6 for samples in points[0][0]], values, row, COLOURS[row]))
        title = "Over training, on the held-out performer (figures 4.5 and 4.7)"
        plots.append(Plot(title, measure, figure(lines, "control steps [millions]", measure, height=340)))
    return plots
