"""Signs that a recording was taken for something that it is not: upside down, mirrored, no human, a wrong rate.

The limits were chosen from 150 real clips of the kinds in docs/data.md: each is well beyond what any of them has.
"""

from itertools import pairwise

import numpy as np

from datasets.joints.joint_tree import JointMap
from datasets.motion.clip import BodyMotion
from datasets.motion.rotation import cross, rotate
from datasets.motion.skeleton import joint_tracks
from datasets.motion.vectors import unit_vector
from datasets.performer.file_axes import nearest_axis
from datasets.performer.performer_clip import PerformerClip, leg_length
from datasets.retarget.gait_tempo import USUAL_RATIO, measure_gait_tempo
from datasets.retarget.retarget import Retargeted, foot_tip

MOST_OF_A_TAKE = 2 / 3  # of the frames
MAX_LYING_SLOPE = 0.5  # height over length of a trunk that lies: 30 degrees
MIN_KNEE_EVIDENCE = 0.15  # mean sine of a knee's bend; 0.64 the median of real clips, and -0.12 the lowest, of a suit whose pelvis turned
MIN_TOE_EVIDENCE = 0.3  # mean cosine between the feet and the front of their shins; 0.90, at least 0.42, and -0.14
MIN_WALK_EVIDENCE = 0.3  # leg lengths a second, where a foot has no toe
COMMON_RATES = (24.0, 30.0, 60.0, 120.0, 240.0)  # 1/s
MIN_RATE, MAX_RATE = 10.0, 500.0  # 1/s, of capture systems
USUAL_LIMB_SPEED = 2.8  # leg lengths a second, of hands and feet against the pelvis: their 95th percentile in the median clip
MAX_LIMB_SPEED = 9.0  # the same beyond what anybody does; 5.6 in a dash
# A walk in slow motion. None of 704 real clips has all three; at a fifth of their rate 106 of 108 walks with steps have them, at 25 for 60
# fps 66 of 103, at half of it 26 of 103
MAX_TEMPO_RATIO = 0.35  # of the accelerations and the least ones by gravity; 1.2 in the median
MIN_TEMPO_CORRELATION = 0.5  # of the two
MIN_SLOW_STANCE_S = 0.6  # s, on one foot; 0.4 in the median
SPEED_SPAN_S = 1.0 / 30.0  # s, over which speeds are measured
# Lengths over the leg's, and bones over the next ones of the limb: smallest and largest that a body may have
PROPORTIONS = {
    "arms": (0.3, 1.1),  # 0.54 to 0.64 in real clips
    "the trunk": (0.3, 1.5),  # 0.48 to 0.78
    "the hips": (0.02, 0.6),  # 0.16 to 0.25
    "the shoulders": (0.08, 1.0),  # 0.25 to 0.47
}
MAX_SIDE_RATIO = 1.3  # of the longer leg or arm and the other


def find_implausible(retargeted: Retargeted) -> tuple[str, ...]:
    """Return a line for each sign that a recording is not what it was taken for, with the option that mends it.

    What the user said (``ReadingOptions``) is not doubted, but for left and right.
    """
    clip = retargeted.performer_clip
    own, places = clip.motion, {body: number for number, body in enumerate(clip.joint_map)}
    tracks = joint_tracks(own.skeleton.parents, own.local_positions, own.local_rotations, list(clip.joint_map.values()))
    leg, said = leg_length(tracks[0], places), clip.reading
    at = {body: tracks[0][:, number] / leg for body, number in places.items()}
    feet = {side: tracks[1][:, places[f"foot_{side}"]] for side in "lr"}
    found = [
        None if said.up_axis else _upside_down(clip, at) or _lying(clip, at),
        _mirrored(clip, at, feet),
        None if said.joints else _proportions(clip.joint_map, clip.motion.skeleton.names, at),
        None if said.fps else _rate(at, clip.motion.fps) or _slow_motion(retargeted.motion),
    ]
    return tuple(line for line in found if line)


def _trunk_slope(at: dict[str, np.ndarray]) -> np.ndarray:
    """Return the height of the head above the pelvis over their distance, shape (T,)."""
    return unit_vector(at["head"] - at["pelvis"])[:, 2]


def _axis_along(clip: PerformerClip, at: dict[str, np.ndarray]) -> str:
    """Return the signed axis of the file along which the body is long on average, from the feet to the head."""
    return nearest_axis(clip.axes.T @ np.mean(at["head"] - 0.5 * (at["foot_l"] + at["foot_r"]), axis=0))


def _upside_down(clip: PerformerClip, at: dict[str, np.ndarray]) -> str | None:
    share = np.mean(_trunk_slope(at) < -MAX_LYING_SLOPE)
    if share < MOST_OF_A_TAKE:
        return None
    up = _axis_along(clip, at)
    return f"The head is under the pelvis in {share:.0%} of the take. If nobody stands on their hands, name the axis: --up {up}."


def _lying(clip: PerformerClip, at: dict[str, np.ndarray]) -> str | None:
    share = np.mean(np.abs(_trunk_slope(at)) < MAX_LYING_SLOPE)
    if share < MOST_OF_A_TAKE:
        return None
    return f"Somebody lies or crawls in {share:.0%} of the take. If they stand, name the axis that points up: --up {_axis_along(clip, at)}."


def _mirrored(clip: PerformerClip, at: dict[str, np.ndarray], feet: dict[str, np.ndarray]) -> str | None:
    """Return a line if knees bend forward and toes, or without them the way, point backward: left and right are exchanged.

    Args:
        clip: Clip on its own skeleton.
        at: Body -> positions of its joint [leg lengths], shape (T, 3).
        feet: "l", "r" -> rotations of the foot's joint in the world, wxyz, shape (T, 4).
    """
    left = unit_vector(at["thigh_l"] - at["thigh_r"])
    ahead = unit_vector(cross(left, at["head"] - at["pelvis"]))
    knees, toes = [], []
    for side in "lr":
        thigh = unit_vector(at[f"shin_{side}"] - at[f"thigh_{side}"])
        shin = unit_vector(at[f"foot_{side}"] - at[f"shin_{side}"])
        knees.append(np.mean(np.sum(cross(thigh, shin) * left, axis=-1)))
        tip = foot_tip(clip, f"foot_{side}")
        if tip.any():
            foot = rotate(feet[side], np.broadcast_to(unit_vector(tip), ahead.shape))
            toes.append(np.mean(np.sum(foot * cross(left, -shin), axis=-1)))
    way = np.sum(np.gradient(at["pelvis"], axis=0) * ahead, axis=-1).mean() * clip.motion.fps if len(ahead) > 1 else 0.0
    against = np.mean(toes) < -MIN_TOE_EVIDENCE if toes else way < -MIN_WALK_EVIDENCE
    if np.mean(knees) > -MIN_KNEE_EVIDENCE or not against:
        return None
    mend = "leave out --mirror" if clip.reading.mirror else "a left-handed export has exchanged them: --mirror"
    return f"Knees bend forward and {'toes point' if toes else 'the way leads'} backward, as if left were right; {mend}."


def _proportions(joint_map: JointMap, names: tuple[str, ...], at: dict[str, np.ndarray]) -> str | None:
    def length(*chain: str) -> float:
        return float(sum(np.median(np.linalg.norm(at[a] - at[b], axis=-1)) for a, b in pairwise(chain)))

    legs = [length(f"thigh_{side}", f"shin_{side}", f"foot_{side}") for side in "lr"]
    arms = [length(f"upper_arm_{side}", f"forearm_{side}", f"hand_{side}") for side in "lr"]
    lengths = {
        "arms": float(np.mean(arms)),
        "the trunk": length("pelvis", "head"),
        "the hips": length("thigh_l", "thigh_r"),
        "the shoulders": length("upper_arm_l", "upper_arm_r"),
    }
    odd = [f"{part} {lengths[part]:.2g} of the legs' length" for part, (low, high) in PROPORTIONS.items() if not low < lengths[part] < high]
    odd += [
        f"one {limb} {max(pair) / max(min(pair), 1e-6):.2g} times as long as the other"
        for limb, pair in (("leg", legs), ("arm", arms))
        if max(pair) > MAX_SIDE_RATIO * min(pair)
    ]
    if not odd:
        return None
    taken = ", ".join(f"{body} '{names[joint_map[body]]}'" for body in ("head", "hand_l", "foot_l"))
    odd_parts = ", ".join(odd)
    return f"No human is so: {odd_parts}. An animal, a prop, or wrong joints ({taken})? A mapping file names the right ones: --mapping."


def _rate(at: dict[str, np.ndarray], fps: float) -> str | None:
    ends = np.stack([at[body] - at["pelvis"] for body in ("foot_l", "foot_r", "hand_l", "hand_r")], axis=1)
    if len(ends) < 2:
        return None
    speed = _limb_speed(ends, fps)
    if speed <= MAX_LIMB_SPEED and MIN_RATE <= fps <= MAX_RATE:
        return None
    likely = min(COMMON_RATES, key=lambda rate: abs(np.log(max(_limb_speed(ends, rate), 1e-6) / USUAL_LIMB_SPEED)))
    if speed > MAX_LIMB_SPEED:
        odd = f"At {fps:g} fps hands and feet would move at {speed:.0f} leg lengths a second, as nobody's do"
    else:
        odd = f"{fps:g} fps are no capture system's rate"
    return f"{odd}; {likely:g} fps are likely: --fps {likely:g}."


def _slow_motion(motion: BodyMotion) -> str | None:
    """Return a line if somebody walks so slowly that they would fall from one foot onto the other sooner."""
    tempo = measure_gait_tempo(motion)
    if tempo is None or tempo.ratio > MAX_TEMPO_RATIO or tempo.correlation < MIN_TEMPO_CORRELATION or tempo.stance_s < MIN_SLOW_STANCE_S:
        return None
    slow = np.sqrt(USUAL_RATIO / tempo.ratio)
    likely = min(COMMON_RATES, key=lambda rate: abs(np.log(rate / (slow * motion.fps))))
    odd = f"At {motion.fps:g} fps somebody walks about {slow:.1f} times as slowly as bodies fall from one foot onto the other"
    return f"{odd}; {likely:g} fps are likely: --fps {likely:g}."


def _limb_speed(ends: np.ndarray, fps: float) -> float:
    """Return the 95th percentile of the speed of hands and feet (T, 4, 3) [leg lengths], if ``fps`` is the frame rate."""
    span = max(1, min(round(SPEED_SPAN_S * fps), (len(ends) - 1) // 8))
    return float(np.percentile(np.linalg.norm(ends[span:] - ends[:-span], axis=-1), 95)) * fps / span
