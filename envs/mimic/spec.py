"""Specification of the mimicking task: constants, configurations, observation slices and residual hinges.

Numbers come from chapter 4 of the thesis (Tables 4.1 to 4.3, eq. 4.5 to 4.10) as docs/errata.md corrects them.
"""

from dataclasses import dataclass
from functools import cached_property

from datasets.motion.humanoid import BODY_COUNT, BODY_NAMES, HINGE_COUNT, HINGES

EPISODE_FRAMES = 300  # of the reference: 5 s, 150 control steps
ALPHA_LOCAL, ALPHA_POSITION, ALPHA_VELOCITY = 2.5, 1.0, 0.1  # Table 4.2
DEVIATION_DISCOUNT_OFFSET, DEVIATION_DISCOUNT_SLOPE_PER_M = 1.3, 1.4  # eq. 4.9; the slope per metre
DEVIATION_DISCOUNT_THRESHOLD = 0.025  # Table 4.2: smallest discount before the reference is lost
MIN_FALLEN_BODIES = 3  # bodies of the trunk on the ground
TOUCH_HEIGHT_M = 0.005  # m, largest height of a shape's lowest point that touches the ground
REWARD_TERMS = ("local_pose", "position", "velocity")  # each at most 1 a step
# 20 residuals without a spinal joint: 2 x (3 + 1 + 3 + 3). The thesis's own list is lost (docs/errata.md).
KEY_BODIES = tuple(f"{body}_{side}" for side in "lr" for body in ("upper_arm", "thigh", "shin", "foot"))
# Neither the thesis nor Bergamin et al. lists the reduced bodies of `drecon`: these are ours (docs/errata.md).
REDUCED_BODIES = ("pelvis", "head", "hand_l", "hand_r", "foot_l", "foot_r")
CONFIGURATIONS = ("adapt", "drecon", "full")
PENALTY_FIELDS = ("foot_slip", "action_rate")  # fields of MimicSpec: weights of the penalties


@dataclass(frozen=True)
class MimicSpec:
    """One variant of the mimicking task; the defaults are the thesis's.

    Attributes:
        configuration: "adapt" observes all bodies and corrects the key joints; "drecon" observes six bodies and corrects
            the same joints; "full" observes all bodies and corrects all 43 hinges (thesis 4.5.3).
        frame: Axes of the observed vectors: "world" (thesis) or "heading", the reference's heading, in which the same
            motion looks the same whichever way it faces.
        com_error: Whether the position error of the centre of mass is observed, which is not in Table 4.1.
        com_height: Whether the height of the centre of mass above the ground is observed, which is not in Table 4.1.
        preview: Control steps ahead at which the reference's bodies are observed as well.
        action_scale: Residual angle [rad] of an action of one.
        smoothing: Weight of the newest action, beta of eq. 4.5.
        feed_forward: Whether the torques that carry the reference are fed forward to the motors (``envs.physics.inverse_dynamics``).
        virtual_model: Whether the legs' motors exert the virtual forces of ``envs.mimic.virtual_model`` as well.
        foot_slip: Weight of the foot slip penalty [s/m] (``envs.mimic.penalties``).
        action_rate: Weight of the mean squared change of the smoothed actions in a step.
    """

    configuration: str = "adapt"
    frame: str = "world"
    com_error: bool = False
    com_height: bool = False
    preview: tuple[int, ...] = ()
    action_scale: float = 1.0
    smoothing: float = 0.2
    feed_forward: bool = False
    virtual_model: bool = False
    foot_slip: float = 0.0
    action_rate: float = 0.0

    def __post_init__(self) -> None:
        """Check the values."""
        if self.configuration not in CONFIGURATIONS:
            raise ValueError(f"configuration is '{self.configuration}', should be one of {', '.join(CONFIGURATIONS)}")
        if self.frame not in ("world", "heading"):
            raise ValueError(f"frame is '{self.frame}', should be world or heading")
        if not 0.0 < self.smoothing <= 1.0:
            raise ValueError(f"smoothing is {self.smoothing}, should be above 0 and at most 1")
        if not self.action_scale > 0.0:
            raise ValueError(f"action_scale is {self.action_scale}, should be above 0 [rad]")
        for name in PENALTY_FIELDS:
            if not getattr(self, name) >= 0.0:
                raise ValueError(f"{name} is {getattr(self, name)}, should be 0 or more")
        if any(steps < 1 for steps in self.preview):
            raise ValueError(f"preview is {list(self.preview)}, should hold positive numbers of control steps")
        object.__setattr__(self, "preview", tuple(self.preview))

    @cached_property
    def observed_bodies(self) -> tuple[int, ...]:
        """Indices of the bodies in the observation."""
        if self.configuration == "drecon":
            return tuple(BODY_NAMES.index(name) for name in REDUCED_BODIES)
        return tuple(range(BODY_COUNT))

    @cached_property
    def residual_hinges(self) -> tuple[int, ...]:
        """Indices of the hinges that actions correct: alpha_d = 1 in eq. 4.3."""
        if self.configuration == "full":
            return tuple(range(HINGE_COUNT))
        return tuple(h for h, (body, _) in enumerate(HINGES) if BODY_NAMES[body] in KEY_BODIES)

    @property
    def has_penalties(self) -> bool:
        """Whether any penalty is taken from the reward."""
        return self.foot_slip > 0.0 or self.action_rate > 0.0

    @property
    def action_size(self) -> int:
        """Length of an action."""
        return len(self.residual_hinges)

    @cached_property
    def observation_parts(self) -> dict[str, int]:
        """Name and length of each part of the observation, in order (Table 4.1, then the additions)."""
        bodies = 3 * len(self.observed_bodies)
        parts = {
            "com_vel": 3,
            "target_com_vel": 3,
            "com_vel_error": 3,
            "target_horizontal_vel": 2,
            "horizontal_vel_error": 2,
            "body_pos": bodies,
            "body_vel": bodies,
            "body_pos_error": bodies,
            "body_vel_error": bodies,
            "smoothed_action": self.action_size,
        }
        if self.com_error:
            parts["com_pos_error"] = 3
        if self.preview:
            parts["preview_body_pos"] = bodies * len(self.preview)
        if self.com_height:
            parts["com_height"] = 1
        return parts

    @cached_property
    def observation_slices(self) -> dict[str, slice]:
        """Slice of each part in the observation, by name."""
        slices, start = {}, 0
        for name, size in self.observation_parts.items():
            slices[name] = slice(start, start + size)
            start += size
        return slices

    @property
    def observation_size(self) -> int:
        """Length of an observation: 273 for the thesis's configuration."""
        return sum(self.observation_parts.values())


PART_TEXT = {
    "com_vel": ("m/s", "velocity of the agent's centre of mass"),
    "target_com_vel": ("m/s", "velocity of the reference's centre of mass"),
    "com_vel_error": ("m/s", "their difference, agent less reference"),
    "target_horizontal_vel": ("m/s", "horizontal velocity of the reference's pelvis"),
    "horizontal_vel_error": ("m/s", "the agent's less the reference's"),
    "body_pos": ("m", "origins of the bodies from the agent's centre of mass"),
    "body_vel": ("m/s", "velocities of the bodies"),
    "body_pos_error": ("m", "body_pos less the same of the reference"),
    "body_vel_error": ("m/s", "body_vel less the same of the reference"),
    "smoothed_action": ("1", "actions of the step before, smoothed (eq. 4.5)"),
    "com_pos_error": ("m", "agent's centre of mass less the reference's"),
    "com_height": ("m", "height of the agent's centre of mass above the ground"),
    "preview_body_pos": ("m", "reference's bodies, steps ahead, from the agent's centre of mass"),
}


def observation_table(spec: MimicSpec) -> str:
    """Return a Markdown table of the observation's parts, for docstrings and docs."""
    rows = ["| part | from | to | unit | what |", "|---|---|---|---|---|"]
    for name, where in spec.observation_slices.items():
        unit, text = PART_TEXT[name]
        rows.append(f"| {name} | {where.start} | {where.stop} | {unit} | {text} |")
    return "\n".join(rows)


def action_table(spec: MimicSpec) -> str:
    """Return a Markdown table of the corrected hinges, for docstrings and docs."""
    rows = ["| action | hinge | unit |", "|---|---|---|"]
    for action, hinge in enumerate(spec.residual_hinges):
        body, axis = HINGES[hinge]
        rows.append(f"| {action} | {BODY_NAMES[body]} {axis} | {spec.action_scale:g} rad |")
    return "\n".join(rows)
