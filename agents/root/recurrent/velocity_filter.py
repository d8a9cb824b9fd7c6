"""Velocity of the centre of mass from feet that stand and from accelerations, blended as the recurrent network says.

P patches of K = 4 frames, in the world's axes. While feet carry the body, the pelvis moves opposite to the points that the network takes
to stand, corrected by a velocity that it adds: a suit's legs make steps too short or too long, and feet slide. While nothing carries it,
the centre of mass keeps its velocity and is accelerated. Who feels his weight although no foot carries it hangs or sits: then the
vertical velocity fades, for biases of the accelerations would add up. It is a Kalman filter of the velocity whose gains the network
predicts.
"""

from math import exp
from typing import NamedTuple

from agents.root.recurrent.patches import PATCH_FRAMES, PATCH_S
from agents.root.recurrent.stance_weights import stance_weights
from datasets.cleanup.ballistic_flight import AIRBORNE_WEIGHT_RATIO, GROUNDED_WEIGHT_RATIO
from datasets.imu.root_features import ROOT_RATE_HZ, to_heading_frame
from datasets.imu.sensor_model import GRAVITY_VECTOR_M_S2
from datasets.motion.humanoid import GRAVITY_M_S2
from datasets.motion.rotation import Array, Constant, array_namespace

_PARTS = (slice(0, 4), slice(4, 7), slice(7, 10), slice(10, 12))  # of ``OUTPUT_COUNT``, as ``patch_steps`` lists them
_SECONDS = Constant([[(frame + 1) / ROOT_RATE_HZ] for frame in range(PATCH_FRAMES)])  # s, since a patch's first frame, shape (K, 1)
_GRAVITY = Constant(GRAVITY_VECTOR_M_S2)
_UP = Constant([0.0, 0.0, 1.0])
HANGING_TIME_CONSTANT_S = 0.5  # s, with which the vertical velocity fades of somebody who hangs
HANGING_DECAY = 1.0 - exp(-PATCH_S / HANGING_TIME_CONSTANT_S)
_USUAL_LOGIT = 2.0  # of support and gain: people mostly stand


class PatchMotion(NamedTuple):
    """What poses and sensors tell of the frames of patches.

    Attributes:
        points: Ankles and toe joints relative to the pelvis in a patch's first frame and those after it [m], shape (P, K + 1, 4, 3).
        centre: Centre of mass relative to the pelvis in the same frames [m], shape (P, K + 1, 3).
        acceleration: Mean free acceleration of the centre of mass during the patch [m/s^2], shape (P, 3); zero where it is unknown.
        heading: Heading of the pelvis in the first frame [rad], shape (P,).
    """

    points: Array
    centre: Array
    acceleration: Array
    heading: Array


class PatchSteps(NamedTuple):
    """Displacements of the pelvis in patches, up to the velocity with which a patch begins.

    Attributes:
        known: Displacement since the patch's first frame without the part of that velocity [m], shape (P, K, 3).
        seconds: Time by which it is multiplied to give the rest [s], shape (P, K, 1).
        keep: Share of each component that is left at the end of the patch, shape (P, 3).
        gained: What the velocity gains during the patch [m/s], shape (P, 3).
        by_feet: Velocity of the centre of mass at the patch's beginning by the feet alone [m/s], shape (P, 3).
    """

    known: Array
    seconds: Array
    keep: Array
    gained: Array
    by_feet: Array


def patch_steps(outputs: Array, motion: PatchMotion) -> PatchSteps:
    """Return the displacements of the pelvis in patches, NumPy or torch.

    Args:
        outputs: Outputs of the network, shape (P, ``OUTPUT_COUNT``): a logit for each point that may carry the body, a velocity [m/s] and
            an acceleration [m/s^2] that are added, in the pelvis' heading, logits of how surely feet carry the body and of the gain.
        motion: What poses and sensors tell of these patches.
    """
    xp = array_namespace(outputs)
    seconds = _SECONDS.like(motion.centre)
    logits, added, accelerated, gates = (outputs[:, part] for part in _PARTS)
    added, accelerated = to_heading_frame(added, -motion.heading), to_heading_frame(accelerated, -motion.heading)
    support, gain = (1.0 / (1.0 + xp.exp(-(gates[:, part : part + 1] + _USUAL_LOGIT))) for part in (0, 1))
    weights = stance_weights(motion.points, logits)[:, None, :, None]
    stood = -(weights * (motion.points[:, 1:] - motion.points[:, :1])).sum(2) + added[:, None] * seconds
    swung = motion.centre[:, 1:] - motion.centre[:, :1]
    acceleration = motion.acceleration + accelerated
    flown = 0.5 * acceleration[:, None] * seconds**2 - swung
    held = support[:, None]
    mean_velocity = (stood[:, -1] + swung[:, -1]) / PATCH_S
    felt = ((acceleration - _GRAVITY.like(acceleration)) ** 2).sum(-1)[:, None] ** 0.5 / GRAVITY_M_S2
    hangs = (1.0 - support) * xp.clip((felt - AIRBORNE_WEIGHT_RATIO) / (GROUNDED_WEIGHT_RATIO - AIRBORNE_WEIGHT_RATIO), 0.0, 1.0)
    share, kept = support * gain, 1.0 - HANGING_DECAY * hangs * _UP.like(hangs)
    return PatchSteps(
        held * stood + (1.0 - held) * flown,
        (1.0 - held) * seconds,
        (1.0 - share) * kept,
        (1.0 - share) * kept * acceleration * PATCH_S + share * (mean_velocity + 0.5 * acceleration * PATCH_S),
        mean_velocity - 0.5 * acceleration * PATCH_S,
    )


def patch_velocities(steps: PatchSteps) -> Array:
    """Return the velocity of the centre of mass with which each patch begins [m/s], shape (P, ..., 3), NumPy or torch.

    Args:
        steps: Displacements in consecutive patches from a clip's beginning on, with further dimensions after the first if need be.
    """
    velocities = [steps.by_feet[0]]
    for keep, gained in zip(steps.keep[:-1], steps.gained[:-1], strict=True):
        velocities.append(keep * velocities[-1] + gained)
    return array_namespace(steps.keep).stack(velocities)


def patch_displacements(steps: PatchSteps, velocities: Array) -> Array:
    """Return how the pelvis moves from the first frame of each patch to those after it [m], shape (P, ..., K, 3).

    Args:
        steps: Displacements up to the velocity.
        velocities: Velocity of the centre of mass with which each patch begins [m/s], shape (P, ..., 3).
    """
    return steps.known + steps.seconds * velocities[..., None, :]
