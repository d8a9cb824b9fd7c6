"""A training of seconds as a program of its own, to be killed: ``python -m tests.trainers.small_run DIR [key=value ...] [--resume]``.

Its collectors are given up as hung after seconds instead of minutes.
"""

import sys
from dataclasses import replace
from pathlib import Path

from configs.exit_codes import run_command
from configs.load import load_config, save_config
from datasets.library.sources import SourceMotion
from tests.trainers.conftest import small_run, standing
from trainers.algorithms.ppo_config import PpoConfig
from trainers.data import training_motions as motions
from trainers.distributed import ray_pool
from trainers.ppo import cli as ppo

LATE_SECONDS, HUNG_SECONDS = 1.0, 4.0


def small(folder: Path) -> PpoConfig:
    """Return the config of a run of 20 iterations of 64 samples, with a checkpoint after each."""
    config = small_run("small", folder)
    return replace(config, collect=replace(config.collect, actors=2), samples=20 * 64, evaluate_every=100, checkpoint_every=1)


def main() -> None:
    """Train as the command line says."""
    folder, *settings = sys.argv[1:]
    written = Path(folder) / "small.yaml"
    save_config(small(Path(folder)), written)
    ray_pool.MIN_STRAGGLER_S, ray_pool.MIN_HANG_S = LATE_SECONDS, HUNG_SECONDS
    clips = [SourceMotion(standing("one", "ann")), SourceMotion(standing("two", "bob", 130))]
    motions.load_source_motions = lambda *_, **__: clips
    config = load_config(PpoConfig, written, [text for text in settings if text != "--resume"])
    ppo.train(config, "--resume" in settings)


if __name__ == "__main__":
    sys.exit(run_command(main))
