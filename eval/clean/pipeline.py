"""The cleaning pipeline, BVH in, clean BVH out; its stages, one after the other, are ``run_stages`` of ``eval/clean/stage_order.py``."""

from collections.abc import Callable, Collection
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Self

from agents.restore.model import RestoreModel
from agents.weights.pretrained import PRETRAINED_POLICY, load_pretrained_restore
from datasets.formats.bvh import Bvh
from datasets.motion.clip import BodyMotion
from datasets.performer.reading_options import ReadingOptions
from eval.clean.edits import PHYSICS, RESTORE, Edits
from eval.clean.progress import WRITING
from eval.clean.quality import GOOD, QUALITIES, SimulationSettings, Simulator
from eval.clean.result import CleaningResult
from eval.clean.session import CleaningSession
from trainers.algorithms.policy_file import load_policy


@dataclass(frozen=True)
class CleaningPipeline:
    """The stages of cleaning with a policy and a restoring network.

    Attributes:
        simulator: Policy and settings of the search; None leaves physics out.
        restorer: Restoring network; None leaves the poses of suits as they were captured.
    """

    simulator: Simulator | None
    restorer: RestoreModel | None = None

    @classmethod
    def load(cls, threads: int, path: Path = PRETRAINED_POLICY, search: SimulationSettings | None = None) -> Self:
        """Return the pipeline with the policy of a file, the package's by default, and the package's restoring network.

        Args:
            threads: Native threads of the simulation.
            path: File of the policy.
            search: Settings of the search; by default those of good quality.

        Raises:
            InputError: If there is no such file, or it holds no policy.
        """
        policy, _, spec = load_policy(path)
        return cls(Simulator(policy, spec, threads, search or QUALITIES[GOOD]), load_pretrained_restore())

    def without(self, stages: Collection[str]) -> Self:
        """Return the pipeline without some of ``STAGES``."""
        restorer = None if RESTORE in stages else self.restorer
        return replace(self, restorer=restorer, simulator=None if PHYSICS in stages else self.simulator)

    def clean(
        self,
        bvh: Bvh,
        name: str,
        reading: ReadingOptions | None = None,
        truth: BodyMotion | None = None,
        progress: Callable[[str, float], None] = lambda _stage, _share: None,
        edits: Edits | None = None,
    ) -> tuple[Bvh, CleaningResult]:
        """Return a cleaned clip: the BVH to write, and the clip before and after for the report.

        Args:
            bvh: Parsed input file.
            name: Name of the clip in messages and in the report.
            reading: Joint names, unit, axes, rate and ground that the user gave.
            truth: Clean clip behind the input at 60 fps, where it is known; measured in the report, never used.
            progress: Called with the name of each stage of ``eval.clean.progress`` as it begins, and with the share of it that is done.
            edits: What a person changed; of it ``reading`` counts for nothing here.

        Raises:
            InputError: If no human skeleton is found in the file, or an edit is of a time outside it.
        """
        session = CleaningSession(bvh, name, self, reading, progress)
        result = replace(session.solve(edits, progress=progress), truth=truth)
        progress(WRITING, 0.0)
        return session.write(result), result
