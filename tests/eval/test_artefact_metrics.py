"""Artefact metrics of clips whose numbers a person can work out."""

from dataclasses import replace

import numpy as np
import pytest

from datasets.humanoid import BODY_COUNT, NAMES
from datasets.motion import BodyMotion
from datasets.rotation import about_axis, multiply
from eval.artefact_metrics import (
    artefacts,
    distance_local,
    distance_world,
    floating,
    foot_contacts,
    foot_skate,
    ground_penetration,
    imbalance,
    jitter,
    self_penetration_depths,
    skating_ratio,
)

STANDING = 0.94  # m, of the pelvis: hip 0.03 below it, leg 0.42 + 0.41, ankle 0.08 above the sole
X, Y, Z = np.eye(3)
FRAMES = 60


def clip(root: np.ndarray, fps: float = 60.0, **turns: np.ndarray) -> BodyMotion:
    """Return a T-pose along ``root`` (T, 3) in which the named bodies are turned by quaternions (4,) or (T, 4)."""
    local = np.tile([1.0, 0.0, 0.0, 0.0], (len(root), BODY_COUNT, 1))
    for name, turn in turns.items():
        local[:, NAMES.index(name)] = turn
    return BodyMotion(root, local, fps, "test")


def path(x: np.ndarray | float = 0.0, z: np.ndarray | float = STANDING, frames: int = FRAMES) -> np.ndarray:
    """Return root positions (T, 3)."""
    root = np.zeros((frames, 3))
    root[:, 0], root[:, 2] = x, z
    return root


def turn(axis: np.ndarray, radians: float) -> np.ndarray:
    """Return one quaternion."""
    return about_axis(axis, np.array(radians))


def sliding(speed: float, z: float = STANDING) -> BodyMotion:
    """Return a T-pose that slides forward [m/s]."""
    return clip(path(speed * np.arange(FRAMES) / 60.0, z))


def test_standing_still_is_flawless() -> None:
    """Standing on the ground has contacts and no artefact."""
    still = clip(path())
    assert foot_contacts(still).all()
    assert artefacts(still) == pytest.approx(dict.fromkeys(artefacts(still), 0.0), abs=1e-9)


def test_foot_slides_at_20_cm_per_second() -> None:
    """Both feet slide at 20 cm/s, which is skate but under GMD's 0.5 m/s; at 60 cm/s every frame skates."""
    assert foot_skate(sliding(0.2)) == pytest.approx(20.0)
    assert skating_ratio(sliding(0.2)) == 0.0
    assert skating_ratio(sliding(0.6)) == 1.0


def test_skate_does_not_depend_on_the_frame_rate() -> None:
    """The same 20 cm/s at 30 fps: 1/150 m per frame x 30 = 0.2 m/s."""
    assert foot_skate(clip(path(np.arange(FRAMES) / 150.0), fps=30.0)) == pytest.approx(20.0)


def test_turning_foot_skates_by_its_lowest_corner() -> None:
    """A toe-up foot turns about its heel's lower edge, which is the lowest point and stands still: no skate.

    The left foot pitches up by t/2 rad about its ankle while the root moves so that the heel corner (-0.06, -0.08) stays:
    turned by -a about y it lies at x = -0.06 cos a + 0.08 sin a and z = -0.06 sin a - 0.08 cos a from the ankle.
    The other foot is lifted out of the way by bending the right knee by 90 degrees.
    """
    a = 0.5 * np.arange(FRAMES) / 60.0
    x, z = 0.06 * np.cos(a) - 0.08 * np.sin(a), 0.06 * np.sin(a) + 0.08 * np.cos(a) + 0.86
    one = clip(path(x, z), foot_l=about_axis(Y, -a), shin_r=turn(Y, np.pi / 2))
    assert foot_skate(one) == pytest.approx(0.0, abs=1e-9)


def test_floats_3_cm() -> None:
    """Three centimetres in the air: 30 mm, no contact and so no skate, unless the truth says that it should stand."""
    above = sliding(0.2, STANDING + 0.03)
    assert floating(above) == pytest.approx(30.0)
    assert ground_penetration(above) == 0.0
    assert foot_skate(above) == 0.0
    assert foot_skate(above, truth=sliding(0.0)) == pytest.approx(20.0)


def test_flight_of_the_truth_is_not_floating() -> None:
    """The truth jumps 10 cm high in half of the frames; in the others the clip floats by 3 cm."""
    jump = np.where(np.arange(FRAMES) < FRAMES // 2, 0.1, 0.0)
    truth, clip_above = clip(path(z=STANDING + jump)), clip(path(z=STANDING + jump + 0.03))
    assert floating(truth, truth) == 0.0
    assert floating(truth) == pytest.approx(50.0)  # 100 mm in half of the frames
    assert floating(clip_above, truth) == pytest.approx(30.0)


def test_sinks_2_cm() -> None:
    """Two centimetres under ground in half of the frames, 4 mm in the others, which is tolerated: 10 mm on average."""
    depth = np.where(np.arange(FRAMES) < FRAMES // 2, 0.02, 0.004)
    sunk = clip(path(z=STANDING - depth))
    assert ground_penetration(sunk) == pytest.approx(10.0)
    assert floating(sunk) == 0.0


@pytest.mark.parametrize("fps", [60.0, 100.0, 30.0])
def test_jitter_of_a_cubic(fps: float) -> None:
    """Every joint follows x = 100 t^3, whose third derivative is 600 m/s^3 = 0.6 km/s^3 at every rate."""
    seconds = np.arange(FRAMES) / fps
    assert jitter(clip(path(100.0 * seconds**3), fps=fps)) == pytest.approx(0.6, rel=1e-6)


def test_crossed_thighs_overlap_by_3_cm() -> None:
    """Both thighs tilt inwards by asin(0.1): their capsules end 0.35 m down, 0.09 - 0.035 = 0.055 m from the middle.

    The axes are 0.11 m apart there, the radii 0.07 m each: they overlap by 0.14 - 0.11 = 0.03 m. The shins are bent by 90
    degrees and turned outwards, so that nothing else touches. Half of the frames stand straight.
    """
    tilt = np.where(np.arange(FRAMES) < FRAMES // 2, np.arcsin(0.1), 0.0)
    bent = turn(Y, np.pi / 2)
    left, right = (multiply(about_axis(X, s * -tilt), np.tile(turn(Z, s * -np.pi / 2), (FRAMES, 1))) for s in (1.0, -1.0))
    crossed = clip(path(), thigh_l=left, thigh_r=right, shin_l=bent, shin_r=bent)
    assert self_penetration_depths(crossed)[: FRAMES // 2] == pytest.approx(0.03, abs=1e-6)
    values = artefacts(crossed)
    assert values["self_penetration"] == 0.5
    assert values["self_penetration_depth"] == pytest.approx(15.0, abs=1e-3)


def leaning(radians: float) -> BodyMotion:
    """Return a body that leans forward about its ankles, 0.86 m under the pelvis, with flat feet."""
    root = path(0.86 * np.sin(radians), 0.08 + 0.86 * np.cos(radians))
    flat = turn(Y, -radians)
    return clip(root, pelvis=turn(Y, radians), foot_l=flat, foot_r=flat)


def test_leaning_out_of_the_feet_is_imbalance() -> None:
    """The soles reach 0.20 m before the ankle; the centre of mass is near the pelvis, so at least 0.8 m above the ankle.

    At 4 degrees it is 0.06 m before the ankle: balanced. At 30 degrees it is more than 0.8 sin 30 = 0.40 m: fallen.
    """
    assert imbalance(leaning(np.radians(4.0))) == 0.0
    assert imbalance(leaning(np.radians(30.0))) == 1.0


def test_distances() -> None:
    """A shift of 5 cm moves all 20 joints; an elbow bent by 90 degrees moves the hand alone by 0.25 sqrt 2 m, a 20th of it on average."""
    still = clip(path())
    shifted, bent = clip(path(0.05)), clip(path(), forearm_l=turn(Z, -np.pi / 2))
    assert distance_world(shifted, still) == pytest.approx(50.0)
    assert distance_local(shifted, still) == pytest.approx(0.0, abs=1e-9)
    assert distance_local(bent, still) == pytest.approx(1e3 * 0.25 * np.sqrt(2.0) / 20.0)


def test_artefacts_names_what_it_was_given() -> None:
    """Errors against the truth and deviations from the original appear only with a truth and an original."""
    still, shifted = clip(path()), clip(path(0.05))
    assert not [key for key in artefacts(still) if key.startswith(("truth", "deviation"))]
    values = artefacts(shifted, truth=still, original=shifted)
    assert values["truth_error_world"] == pytest.approx(50.0)
    assert values["deviation_world"] == 0.0


def test_unequal_clips_are_refused() -> None:
    """Another length or rate cannot be compared, and the message says which."""
    still = clip(path())
    with pytest.raises(ValueError, match="60 frames at 60 fps, test 30 at 60"):
        distance_world(still, still.cut(0, 30))
    with pytest.raises(ValueError, match="at 30"):
        distance_world(still, replace(still, fps=30.0))
