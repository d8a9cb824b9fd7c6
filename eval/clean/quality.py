"""Qualities of the simulation by name, and whatever simulates.

``fast`` is a SAMCON search along the policy (``eval.clean.samcon``); the others optimise the trajectory (``eval.clean.optimisation``).
"""

from dataclasses import dataclass

from agents.policy.policy import Policy
from envs.mimic.spec import MimicSpec

MAX_ASSIST_BW = 0.1  # body weights, largest force on the pelvis with which a frame counts as physics: what a handrail gives


@dataclass(frozen=True)
class SearchSettings:
    """Settings of the search; what the defaults were chosen by stands in docs/cleaning.md.

    Attributes:
        num_samples: Number of simulated worlds.
        num_survivors: Number of samples that are kept at each selection; the first copy of each goes on without noise.
        residual_shares: Smallest and largest share of the policy's residuals in the samples' controllers: the policy lasts but does not
            aim, so that all of a residual moves joints further off than none.
        virtual_share: Share of the controllers whose legs exert the virtual model's forces.
        steps_per_window: Control steps from one selection to the next.
        max_noise_std: Largest standard deviation of the noise on a sample's actions; each has its own in each control step, from 0 on, so
            that some stay near to what is easy to follow and some catch a fall.
        assist_force_bw: Largest force on the pelvis towards the clip [body weights]: what a handrail gives; 0 is none.
    """

    num_samples: int = 192
    num_survivors: int = 48
    residual_shares: tuple[float, float] = (0.0, 0.5)
    virtual_share: float = 0.5
    steps_per_window: int = 1
    max_noise_std: float = 0.4
    assist_force_bw: float = MAX_ASSIST_BW


@dataclass(frozen=True)
class OptimisationSettings:
    """Settings of the optimisation.

    Attributes:
        max_passes: Largest number of passes over each window.
        assist_force_bw: Largest force on the pelvis [body weights], or torque [0.3 m times that], with which a frame counts as physics.
    """

    max_passes: int
    assist_force_bw: float = MAX_ASSIST_BW


SimulationSettings = SearchSettings | OptimisationSettings
FAST, GOOD, BEST = "fast", "good", "best"
QUALITIES: dict[str, SimulationSettings] = {
    FAST: SearchSettings(),
    GOOD: OptimisationSettings(max_passes=6),
    BEST: OptimisationSettings(max_passes=16),
}


@dataclass(frozen=True)
class Simulator:
    """Whatever simulates clips.

    Attributes:
        policy: Policy that the search follows.
        spec: Variant of the mimicking task that it was trained for.
        threads: Native threads.
        search: Settings of the search or of the optimisation.
    """

    policy: Policy
    spec: MimicSpec
    threads: int
    search: SimulationSettings
