"""Measures of the policy studies: Table 4.4 through simulated suits and as recorded, over all rollouts and by folder."""

from collections.abc import Sequence

import numpy as np

from envs.mimic.spec import MimicSpec
from eval.study.policy.unseen_clips import UnseenClips
from trainers.data.training_motions import PreparedMotions
from trainers.evaluation.evaluation_protocol import PolicyFn, evaluate_rollouts

MEASURES = ("episode_length_ratio", "sr90", "root_mse", "max_reward_ratio")  # of Table 4.4
FOLDER_MEASURES = ("episode_length_ratio", "sr90")
ROOT_MSE_TRUTH = "root_mse_truth"
RECORDED_PREFIX = "recorded_"  # of measures on clips as recorded; the table's are through suits
Scores = dict[str, float]


def score_policy(act: PolicyFn, spec: MimicSpec, tested: Sequence[UnseenClips], threads: int) -> Scores:
    """Return means and, except for shares, standard deviations over all rollouts, and means over the rollouts of each folder.

    Args:
        act: Policy.
        spec: Variant of the task that the policy was trained for.
        tested: Test clips, all through suits and all as recorded.
        threads: Native threads.
    """
    scores: Scores = {}
    for suited in (True, False):
        found = {
            one.source: evaluate_rollouts(act, one.library, spec, one.rollouts, threads) for one in tested if one.through_suit == suited
        }
        before = "" if suited else RECORDED_PREFIX
        for name in (*MEASURES, ROOT_MSE_TRUTH) if suited else MEASURES:
            values = np.concat([metrics[name] for metrics in found.values()])
            scores[f"{before}{name}"] = float(values.mean())
            if name != "sr90":
                scores[f"{before}{name}_std"] = float(values.std())
        scores |= {f"{before}{name}_{source}": float(metrics[name].mean()) for source, metrics in found.items() for name in FOLDER_MEASURES}
    return scores


def data_size(motions: PreparedMotions) -> Scores:
    """Return the number of recordings that a training learns from, and of their frames."""
    drawn = [clip for clip, weight in zip(motions.training.clips, motions.weights, strict=True) if weight > 0.0]
    recordings = {clip.name.partition("#")[0] + clip.system for clip in drawn}
    return {"assets": float(len(recordings)), "frames": float(sum(clip.frames for clip in drawn))}
