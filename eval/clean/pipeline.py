"""A BVH in, a clean BVH out: reading, the stages of ``eval.clean.stages``, and the way back to the performer's skeleton."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Self

import numpy as np

from agents.policy.policy import Policy
from agents.weights.pretrained import SHIPPED_POLICY
from datasets.cleanup.ground_levelling import hovers
from datasets.cleanup.off_feet_segments import Span, off_the_ground
from datasets.cleanup.performer_foot_lock import plant_feet
from datasets.formats.bvh import Bvh
from datasets.motion.clip import FPS, BodyMotion
from datasets.motion.kinematics import resample, resample_to
from datasets.retarget.joint_mapping import Mapping
from datasets.retarget.performer_clip import capture
from datasets.retarget.retarget import retarget, retarget_again
from datasets.retarget.transfer_back import to_bvh, transfer
from envs.mimic.spec import MimicSpec
from eval.clean.result import Cleaned
from eval.clean.stages import give_root, inside, perform, repair
from trainers.algorithms.policy_file import load_policy

KEPT = 0.05  # trust below which a frame has nothing of physics in it


@dataclass(frozen=True)
class Cleaner:
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
    def load(cls, path: Path = SHIPPED_POLICY, threads: int = 2) -> Self:
        """Return the cleaner with the policy of a file, the package's by default.

        Raises:
            InputError: If there is no such file, or it holds no policy.
        """
        policy, _, spec = load_policy(path)
        return cls(policy, spec, threads)

    def clean(self, bvh: Bvh, name: str, mapping: Mapping | None = None, truth: BodyMotion | None = None) -> tuple[Bvh, Cleaned]:
        """Return a cleaned clip: what to write, and what is to be told of it.

        Args:
            bvh: What was read.
            name: Of the clip, for people.
            mapping: What is known of its joints, unit and axes.
            truth: The clean clip behind it at 60 fps, where it is known; it is told beside the others, never used.

        Raises:
            InputError: If nothing human is found in the file.
        """
        retargeted = retarget(capture(bvh, name, mapping))
        recorded = resample(retargeted.motion, FPS)
        elsewhere = off_the_ground(recorded)
        # Somebody in the air who neither climbs nor is carried hangs there by the recording's fault.
        located = recorded.rooted and (bool(elsewhere) or not hovers(recorded))
        rooted = recorded if located else give_root(recorded)
        elsewhere = elsewhere if located else off_the_ground(rooted)
        performed = perform(self.policy, self.spec, repair(rooted, elsewhere), elsewhere, self.threads)
        at_own_rate = resample_to(performed.motion, len(retargeted.motion), retargeted.motion.fps)
        nearest = np.minimum(np.arange(len(at_own_rate)) * FPS / at_own_rate.fps + 0.5, len(recorded) - 1).astype(int)
        level = ~inside(elsewhere, len(recorded))
        output = plant_feet(transfer(retargeted, at_own_rate), retargeted, performed.contacts[nearest], level[nearest])
        cleaned = Cleaned(
            name,
            recorded,
            replace(resample(retarget_again(retargeted, output), FPS), name=name),
            performed.contacts,
            performed.trust,
            performed.trust < KEPT,
            tuple(start / FPS for start in performed.starts[1:]),
            _notices(rooted is not recorded, elsewhere),
            truth,
        )
        return to_bvh(bvh, retargeted.capture, output), cleaned


def _notices(reconstructed: bool, elsewhere: list[Span]) -> tuple[str, ...]:
    """Return what a person should know of a clip, one line each."""
    guessed = "The recording does not say where the pelvis went, or lets the figure hover; its path was reconstructed."
    rootless = [guessed] if reconstructed else []
    spans = [
        f"Somebody {span.reason} from {span.start / FPS:.1f} s to {span.stop / FPS:.1f} s: not for feet on level ground, left to itself."
        for span in elsewhere
    ]
    return (*rootless, *spans)
