"""What is taken from the reward beyond the thesis, which knows no price of bad habits: feet that slide, actions that tremble."""

import numpy as np

from datasets.body_state import BodyState
from datasets.humanoid import BODIES, FEET
from envs.mimic_spec import MimicSpec

CONTACT_HEIGHT = 0.02  # m: a foot whose lowest point is lower is in contact, at any speed (METRICS)
_SOLES = np.array([[BODIES[body].shape.points for body in side] for side in FEET], dtype=np.float32)  # (2, 2, 8, 3), sides, bodies, corners


def penalties(spec: MimicSpec, agent: BodyState, change: np.ndarray) -> np.ndarray:
    """Return what is taken from the reward of N worlds, shape (N,).

    Args:
        spec: With the weights.
        agent: Simulated bodies.
        change: Of the smoothed actions in this step, shape (N, A).
    """
    return spec.foot_slip * foot_slip(agent) + spec.action_rate * np.square(change).mean(axis=1)


def foot_slip(agent: BodyState) -> np.ndarray:
    """Return the horizontal speed [m/s] of the lowest point of each foot in contact, summed over both feet, shape (N,)."""
    feet = np.array(FEET)
    arms = np.einsum("nsbij,sbkj->nsbki", agent.rot[:, feet], _SOLES)  # from the bodies' origins to the corners, world axes
    heights = (agent.pos[:, feet, 2][..., None] + arms[..., 2]).reshape(len(arms), len(FEET), -1)
    speeds = agent.lin_vel[:, feet][:, :, :, None] + np.cross(agent.ang_vel[:, feet][:, :, :, None], arms)
    lowest = heights.argmin(axis=2)[..., None]
    slides = np.linalg.norm(speeds[..., :2], axis=-1).reshape(heights.shape)
    height, slide = (np.take_along_axis(of, lowest, axis=2)[..., 0] for of in (heights, slides))
    return np.where(height < CONTACT_HEIGHT, slide, 0.0).sum(axis=1)
