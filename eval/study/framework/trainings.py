"""Trainings of a study that are repeated with several seeds."""

from collections.abc import Callable
from dataclasses import replace

from eval.runs.training_spec import Config, Training


def schedule_training(
    run: Training[Config], seed: int, samples: int, samples_per_update: Callable[[Config], int], evaluations: int
) -> Training[Config]:
    """Return a run with its seed and length; nothing but the seed and the name tells the runs of a row apart.

    Args:
        run: Run with the overrides of its row.
        seed: Seed of the run.
        samples: Samples of the training.
        samples_per_update: Returns how many samples an update of a config takes in.
        evaluations: Number of evaluations on the held-out performer, each with a checkpoint.
    """
    run = replace(run, overrides=(*run.overrides, f"samples={samples}", f"seed={seed}"))
    every = max(1, -(-samples // samples_per_update(run.resolve_config()) // evaluations))
    return replace(run, overrides=(*run.overrides, f"evaluate_every={every}", f"checkpoint_every={every}"))
