"""A BVH in, a clean BVH out: reading, the stages of ``eval.clean.stages``, and the way back to the performer's skeleton."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Self

import numpy as np

from agents.policy.policy import Policy
from agents.weights.pretrained import PRETRAINED_POLICY
from datasets.cleanup.ground_levelling import is_floating
from datasets.cleanup.off_feet_segments import OffFeetSpan, find_off_feet_spans
from datasets.cleanup.performer_foot_lock import lock_performer_feet
from datasets.formats.bvh import Bvh
from datasets.motion.clip import FPS, BodyMotion
from datasets.motion.kinematics import resample, resample_to
from datasets.retarget.joint_mapping import JointMapping
from datasets.retarget.performer_clip import performer_clip_from_bvh
from datasets.retarget.retarget import retarget, retarget_with
from datasets.retarget.transfer_back import to_performer_bvh, transfer_back
from envs.mimic.spec import MimicSpec
from eval.clean.result import CleaningResult
from eval.clean.stages import frame_mask, reconstruct_missing_root, repair_kinematically, simulate_grounded_spans
from trainers.algorithms.policy_file import load_policy

MIN_CONFIDENCE = 0.05  # trust below which a frame has nothing of physics in it


@dataclass(frozen=True)
class CleaningPipeline:
    """What cleans: a policy, and on how many threads.

    Attributes:
        policy: Trained for ``spec``; none to leave physics out.
        spec: Variant of the task.
        threads: Native threads of the simulation.
    """

    policy: Policy | None
    spec: MimicSpec
    threads: int

    @classmethod
    def load(cls, path: Path = PRETRAINED_POLICY, threads: int = 2) -> Self:
        """Return the cleaner with the policy of a file, the package's by default.

        Raises:
            InputError: If there is no such file, or it holds no policy.
        """
        policy, _, spec = load_policy(path)
        return cls(policy, spec, threads)

    def clean(
        self, bvh: Bvh, name: str, mapping: JointMapping | None = None, truth: BodyMotion | None = None
    ) -> tuple[Bvh, CleaningResult]:
        """Return a cleaned clip: what to write, and what is to be told of it.

        Args:
            bvh: What was read.
            name: Of the clip, for people.
            mapping: What is known of its joints, unit and axes.
            truth: The clean clip behind it at 60 fps, where it is known; it is told beside the others, never used.

        Raises:
            InputError: If nothing human is found in the file.
        """
        retargeted = retarget(performer_clip_from_bvh(bvh, name, mapping))
        recorded = resample(retargeted.motion, FPS)
        off_feet = find_off_feet_spans(recorded)
        # Somebody in the air who neither climbs nor is carried hangs there by the recording's fault.
        has_root = recorded.rooted and (bool(off_feet) or not is_floating(recorded))
        rooted = recorded if has_root else reconstruct_missing_root(recorded)
        off_feet = off_feet if has_root else find_off_feet_spans(rooted)
        simulated = simulate_grounded_spans(self.policy, self.spec, repair_kinematically(rooted, off_feet), off_feet, self.threads)
        at_own_rate = resample_to(simulated.motion, len(retargeted.motion), retargeted.motion.fps)
        nearest = np.minimum(np.arange(len(at_own_rate)) * FPS / at_own_rate.fps + 0.5, len(recorded) - 1).astype(int)
        level = ~frame_mask(off_feet, len(recorded))
        output = lock_performer_feet(transfer_back(retargeted, at_own_rate), retargeted, simulated.contacts[nearest], level[nearest])
        cleaned = CleaningResult(
            name,
            recorded,
            replace(resample(retarget_with(retargeted, output), FPS), name=name),
            simulated.contacts,
            simulated.confidence,
            simulated.confidence < MIN_CONFIDENCE,
            tuple(start / FPS for start in simulated.segment_starts[1:]),
            _notices(rooted is not recorded, off_feet),
            truth,
        )
        return to_performer_bvh(bvh, retargeted.performer_clip, output), cleaned


def _notices(reconstructed: bool, off_feet: list[OffFeetSpan]) -> tuple[str, ...]:
    """Return what a person should know of a clip, one line each."""
    guessed = "The recording does not say where the pelvis went, or lets the figure hover; its path was reconstructed."
    rootless = [guessed] if reconstructed else []
    spans = [
        f"Somebody {span.reason} from {span.start / FPS:.1f} s to {span.stop / FPS:.1f} s: not for feet on level ground, left to itself."
        for span in off_feet
    ]
    return (*rootless, *spans)
