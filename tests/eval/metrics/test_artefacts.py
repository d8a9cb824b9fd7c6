"""Artefact metrics of clips whose numbers a person can work out."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from datasets.motion.clip import BodyMotion
from datasets.motion.humanoid import BODY_COUNT, BODY_NAMES
from datasets.motion.rotation import from_axis_angle, multiply
from eval.metrics.artefact_tracks import compute_artefact_tracks, contacts_by_height, self_penetration_depths
from eval.metrics.artefacts import (
    artefact_metrics,
    compare_contact_rules,
    mean_distance_local_mm,
    mean_distance_world_mm,
    removed_shares,
    stance_skate,
    touchdown_error_ms,
)

STANDING = 0.94  # m, of the pelvis: hip 0.03 below it, leg 0.42 + 0.41, ankle 0.08 above the sole
X, Y, Z = np.eye(3)
FRAMES = 60


def clip(root: np.ndarray, fps: float = 60.0, **turns: np.ndarray) -> BodyMotion:
    """Return a T-pose along ``root`` (T, 3) in which the named bodies are turned by quaternions (4,) or (T, 4)."""
    local = np.tile([1.0, 0.0, 0.0, 0.0], (len(root), BODY_COUNT, 1))
    for name, turn in turns.items():
        local[:, BODY_NAMES.index(name)] = turn
    return BodyMotion(root, local, fps, "test")


def path(x: np.ndarray | float = 0.0, z: np.ndarray | float = STANDING, frames: int = FRAMES) -> np.ndarray:
    """Return root positions (T, 3)."""
    root = np.zeros((frames, 3))
    root[:, 0], root[:, 2] = x, z
    return root


def turn(axis: np.ndarray, radians: float) -> np.ndarray:
    """Return one quaternion."""
    return from_axis_angle(axis, np.array(radians))


def sliding(speed: float, z: float = STANDING) -> BodyMotion:
    """Return a T-pose that slides forward [m/s]."""
    return clip(path(speed * np.arange(FRAMES) / 60.0, z))


def found(metric: str, motion: BodyMotion, truth: BodyMotion | None = None) -> float:
    """Return one metric of a clip."""
    return artefact_metrics(motion, truth)[metric]


def test_standing_still_is_flawless() -> None:
    """Standing on the ground has contacts and no artefact."""
    still = clip(path())
    assert contacts_by_height(still).all()
    assert artefact_metrics(still) == pytest.approx(dict.fromkeys(artefact_metrics(still), 0.0), abs=1e-9)


def test_foot_slides_at_20_cm_per_second() -> None:
    """Both feet slide at 20 cm/s, which is skate but under GMD's 0.5 m/s; at 60 cm/s every frame skates."""
    assert found("foot_skate", sliding(0.2)) == pytest.approx(20.0)
    assert found("skating_ratio", sliding(0.2)) == 0.0
    assert found("skating_ratio", sliding(0.6)) == 1.0


def test_skate_does_not_depend_on_the_frame_rate() -> None:
    """The same 20 cm/s at 30 fps: 1/150 m per frame x 30 = 0.2 m/s."""
    assert found("foot_skate", clip(path(np.arange(FRAMES) / 150.0), fps=30.0)) == pytest.approx(20.0)


def test_turning_foot_skates_by_its_lowest_corner() -> None:
    """A toe-up foot turns about its heel's lower edge, which is the lowest point and stands still: no skate.

    The left foot pitches up by t/2 rad about its ankle while the root moves so that the heel corner (-0.06, -0.08) stays:
    turned by -a about y it lies at x = -0.06 cos a + 0.08 sin a and z = -0.06 sin a - 0.08 cos a from the ankle.
    The other foot is lifted out of the way by bending the right knee by 90 degrees.
    """
    a = 0.5 * np.arange(FRAMES) / 60.0
    x, z = 0.06 * np.cos(a) - 0.08 * np.sin(a), 0.06 * np.sin(a) + 0.08 * np.cos(a) + 0.86
    one = clip(path(x, z), foot_l=from_axis_angle(Y, -a), shin_r=turn(Y, np.pi / 2))
    assert found("foot_skate", one) == pytest.approx(0.0, abs=1e-9)


def test_floats_3_cm() -> None:
    """Three centimetres in the air: 30 mm, no contact and so no skate, unless the truth says that it should stand."""
    above = sliding(0.2, STANDING + 0.03)
    assert found("floating", above) == pytest.approx(30.0)
    assert found("ground_penetration", above) == 0.0
    assert found("foot_skate", above) == 0.0
    assert found("foot_skate", above, truth=sliding(0.0)) == pytest.approx(20.0)


def test_flight_of_the_truth_is_not_floating() -> None:
    """The truth jumps 10 cm high in half of the frames; in the others the clip floats by 3 cm."""
    jump = np.where(np.arange(FRAMES) < FRAMES // 2, 0.1, 0.0)
    truth, clip_above = clip(path(z=STANDING + jump)), clip(path(z=STANDING + jump + 0.03))
    assert found("floating", truth, truth) == 0.0
    assert found("floating", truth) == pytest.approx(50.0)  # 100 mm in half of the frames
    assert found("floating", clip_above, truth) == pytest.approx(30.0)


def test_sinks_2_cm() -> None:
    """Two centimetres under ground in half of the frames, 4 mm in the others, which is tolerated: 10 mm on average."""
    depth = np.where(np.arange(FRAMES) < FRAMES // 2, 0.02, 0.004)
    sunk = clip(path(z=STANDING - depth))
    assert found("ground_penetration", sunk) == pytest.approx(10.0)
    assert found("floating", sunk) == 0.0


@pytest.mark.parametrize("fps", [60.0, 100.0, 30.0])
def test_jitter_of_a_cubic(fps: float) -> None:
    """Every joint follows x = 100 t^3, whose third derivative is 600 m/s^3 = 0.6 km/s^3 at every rate."""
    seconds = np.arange(FRAMES) / fps
    assert found("jitter", clip(path(100.0 * seconds**3), fps=fps)) == pytest.approx(0.6, rel=1e-6)


def test_crossed_thighs_overlap_by_3_cm() -> None:
    """Both thighs tilt inwards by asin(0.1): their capsules end 0.35 m down, 0.09 - 0.035 = 0.055 m from the middle.

    The axes are 0.11 m apart there, the radii 0.07 m each: they overlap by 0.14 - 0.11 = 0.03 m. The shins are bent by 90
    degrees and turned outwards, so that nothing else touches. Half of the frames stand straight.
    """
    tilt = np.where(np.arange(FRAMES) < FRAMES // 2, np.arcsin(0.1), 0.0)
    bent = turn(Y, np.pi / 2)
    left, right = (multiply(from_axis_angle(X, s * -tilt), np.tile(turn(Z, s * -np.pi / 2), (FRAMES, 1))) for s in (1.0, -1.0))
    crossed = clip(path(), thigh_l=left, thigh_r=right, shin_l=bent, shin_r=bent)
    assert self_penetration_depths(crossed)[: FRAMES // 2] == pytest.approx(0.03, abs=1e-6)
    values = artefact_metrics(crossed)
    assert values["self_penetration"] == 0.5
    assert values["self_penetration_depth"] == pytest.approx(15.0, abs=1e-3)


def test_forearm_2_cm_inside_the_chest() -> None:
    """The left hand lies on the breastbone: the forearm crosses before the chest, 2 cm too near.

    From the chest's origin, of radius 0.11 m, the chest's axis runs along y from -0.06 to 0.06 at x = 0, z = 0.11; the shoulder is at
    (0, 0.03 + 0.15, 0.20). The upper arm, 0.28 m long, hangs forward to an elbow at x = 0.11 + 0.038 - 0.02 = 0.128 m, the radii of chest
    and forearm less 2 cm: d = sqrt(0.28^2 - 0.128^2) = 0.249 m below the shoulder. From there the forearm runs within the plane
    x = 0.128 towards (0.128, 0.05, 0.11), so that it crosses the chest's axis at right angles to x, at a distance of 0.128 m: the
    crossing is sqrt(0.13^2 + (d - 0.09)^2) = 0.205 m from the elbow, and the forearm's axis reaches from 0.02 to 0.23 m. The hand beyond
    is nearer to the chest's rim: its axis begins 0.28 m from the elbow at z = 0.20 - d + 0.28 x 0.774 = 0.168, so 0.141 m from the
    chest's axis, and it overlaps by no more than 0.11 + 0.035 - 0.141 = 0.004 m.
    """
    d = np.sqrt(0.28**2 - 0.128**2)
    along = np.array([0.128, 0.0, -d]) / 0.28  # of the upper arm, its y axis
    across = np.array([0.0, -0.13, d - 0.09]) / np.hypot(0.13, d - 0.09)  # of the forearm
    axis = np.cross(along, across) / np.linalg.norm(np.cross(along, across))  # of the elbow, the z axis of both
    upper_arm = Rotation.from_matrix(np.stack([np.cross(along, axis), along, axis], axis=1)).as_quat(scalar_first=True)
    bend = turn(Z, np.arccos(along @ across))
    touching = clip(path(), upper_arm_l=upper_arm, forearm_l=bend)
    assert self_penetration_depths(touching) == pytest.approx(0.02, abs=1e-6)
    assert found("self_penetration", touching) == 1.0
    assert found("self_penetration_depth", touching) == pytest.approx(20.0, abs=1e-3)


def leaning(radians: float) -> BodyMotion:
    """Return a body that leans forward about its ankles, 0.86 m under the pelvis, with flat feet."""
    root = path(0.86 * np.sin(radians), 0.08 + 0.86 * np.cos(radians))
    flat = turn(Y, -radians)
    return clip(root, pelvis=turn(Y, radians), foot_l=flat, foot_r=flat)


def test_leaning_out_of_the_feet_is_imbalance() -> None:
    """The soles reach 0.20 m before the ankle; the centre of mass is near the pelvis, so at least 0.8 m above the ankle.

    At 4 degrees it is 0.06 m before the ankle: balanced. At 30 degrees it is more than 0.8 sin 30 = 0.40 m: fallen.
    """
    assert found("imbalance", leaning(np.radians(4.0))) == 0.0
    assert found("imbalance", leaning(np.radians(30.0))) == 1.0


def test_distances() -> None:
    """A shift of 5 cm moves all 20 joints; an elbow bent by 90 degrees moves the hand alone by 0.25 sqrt 2 m, a 20th of it on average."""
    still = clip(path())
    shifted, bent = clip(path(0.05)), clip(path(), forearm_l=turn(Z, -np.pi / 2))
    assert mean_distance_world_mm(shifted, still) == pytest.approx(50.0)
    assert mean_distance_local_mm(shifted, still) == pytest.approx(0.0, abs=1e-9)
    assert mean_distance_local_mm(bent, still) == pytest.approx(1e3 * 0.25 * np.sqrt(2.0) / 20.0)


def test_artefacts_names_what_it_was_given() -> None:
    """Errors against the truth and deviations from the original appear only with a truth and an original."""
    still, shifted = clip(path()), clip(path(0.05))
    assert not [key for key in artefact_metrics(still) if key.startswith(("truth", "deviation"))]
    values = artefact_metrics(shifted, truth=still, original=shifted)
    assert values["truth_error_world"] == pytest.approx(50.0)
    assert values["deviation_world"] == 0.0
    assert artefact_metrics(still, truth=still).keys() == artefact_metrics(still).keys()  # the truth has no error against itself


def test_unequal_clips_are_refused() -> None:
    """Another length or rate cannot be compared, and the message says which."""
    still = clip(path())
    with pytest.raises(ValueError, match="60 frames at 60 fps, test 30 at 60"):
        mean_distance_world_mm(still, still.cut(0, 30))
    with pytest.raises(ValueError, match="at 30"):
        mean_distance_world_mm(still, replace(still, fps=30.0))


def test_tracks_say_when() -> None:
    """The left foot stands while the right one swings, 20 cm/s in the second half; it floats by 3 cm in the last frame.

    The knee is bent by 90 degrees: the shin, 0.41 m long, lies level 0.42 m below the hip, which is 0.91 m up, and the foot hangs upright
    behind: heel, ball and toes, 0.045 m to either side, reach from 0.06 m above to 0.20 m below the ankle, which is 0.49 m high.
    """
    moving = np.arange(FRAMES) >= FRAMES // 2
    root = path(np.cumsum(0.2 / 60.0 * moving), np.where(np.arange(FRAMES) == FRAMES - 1, STANDING + 0.03, STANDING))
    tracks = compute_artefact_tracks(clip(root, shin_r=turn(Y, np.pi / 2)))
    standing = np.arange(FRAMES) < FRAMES - 1
    assert tracks.contacts.tolist() == [[stands, False] for stands in standing]
    assert tracks.sustained_contacts[:, 0].tolist() == [False, *standing[1:]]
    np.testing.assert_allclose(tracks.foot_speed, 0.2 * np.stack([moving, moving], axis=1), atol=1e-12)
    np.testing.assert_allclose(tracks.foot_height[:-1], np.tile([0.0, 0.29], (FRAMES - 1, 1)), atol=1e-12)
    np.testing.assert_allclose(tracks.lowest, np.where(standing, 0.0, 0.03), atol=1e-12)
    assert np.isnan(tracks.com_overhang).tolist() == [not stands for stands in standing]
    assert tracks.penetration_depth.shape == tracks.is_airborne.shape == (FRAMES,)
    assert tracks.jerk.shape == (FRAMES - 3,)


def test_overhang_is_the_distance_from_the_nearest_edge_of_the_feet() -> None:
    """A T-pose stands over the middle between its feet, which reach 0.09 + 0.045 m to the left and to the right.

    Forward they reach from -0.06 to 0.13 + 0.07 m. All bodies are symmetrical to the left and right and only head, feet and toes reach
    forward: by 0.02, 0.035 and 0.13 + 0.035 m with shares of 0.067, 0.010 and 0.002 a side of a total of 1.002, which puts the centre
    of mass at (0.067 x 0.02 + 2 x 0.010 x 0.035 + 2 x 0.002 x 0.165) / 1.002 = 0.0027 / 1.002 m. The nearest edge is the rear one.
    """
    centre = 0.0027 / 1.002
    assert compute_artefact_tracks(clip(path())).com_overhang == pytest.approx(-(0.06 + centre), rel=1e-3)


def test_rule_and_force_agree_in_shares() -> None:
    """Of four feet two agree; one is low without a load, one is loaded without being low. Half of them carry."""
    force = np.array([[True, False], [True, False]])
    height = np.array([[True, True], [False, False]])
    assert compare_contact_rules(force, height) == {"agree": 0.5, "height_alone": 0.25, "force_alone": 0.25, "commoner": 0.5}
    assert compare_contact_rules(force[:0], height[:0]) == {}
    with pytest.raises(ValueError, match="should be equal"):
        compare_contact_rules(force, height[:1])


def test_a_clip_of_one_frame_has_no_speed_and_no_jitter() -> None:
    """Nothing moves within one frame; what a pose shows is still measured."""
    values = artefact_metrics(clip(path(z=STANDING + 0.03, frames=1)))
    assert (values["floating"], values["foot_skate"], values["skating_ratio"], values["jitter"]) == (pytest.approx(30.0), 0.0, 0.0, 0.0)


def test_a_foot_that_stands_skates_as_fast_as_it_glides() -> None:
    # A T-pose that glides at 0.2 m/s: 20 cm/s of either foot, whenever it stands; where none does there is nothing to skate.
    stands = np.zeros((FRAMES, 2), dtype=bool)
    assert stance_skate(sliding(0.2), stands) == 0.0
    stands[5:9, 1] = True
    assert stance_skate(sliding(0.2), stands) == pytest.approx(20.0)


def test_feet_that_stand_in_the_truth_skate_at_any_height() -> None:
    # A T-pose that glides 5 cm above the ground at 0.6 m/s; in the truth it stands. Without a truth or an original it does not, being fast.
    still, gliding = sliding(0.0), sliding(0.6, z=STANDING + 0.05)
    known, original = artefact_metrics(gliding, truth=still), artefact_metrics(gliding, original=still)
    assert (known["stance_skate"], known["foot_skate"]) == (pytest.approx(60.0), pytest.approx(60.0))
    assert (original["stance_skate"], original["foot_skate"]) == (pytest.approx(60.0), 0.0)
    assert artefact_metrics(gliding)["stance_skate"] == 0.0
    assert known["contact_agreement"] == 0.0
    assert "contact_agreement" not in artefact_metrics(still, truth=still)


def test_touch_downs_are_as_far_off_as_the_nearest_one() -> None:
    # The left foot comes down at frames 6 and 40 in the truth, at 9 and 30 in the clip: 3 and 10 frames off at 60 per second.
    # The right one comes down at frame 20 in the truth and never in the clip: 500 ms.
    truth, own = np.zeros((60, 2), dtype=bool), np.zeros((60, 2), dtype=bool)
    truth[6:20, 0] = truth[40:50, 0] = truth[20:, 1] = True
    own[9:20, 0] = own[30:50, 0] = True
    assert touchdown_error_ms(own, truth, 60.0) == pytest.approx((50.0 + 500.0 / 3.0 + 500.0) / 3.0)
    assert touchdown_error_ms(own, np.zeros_like(truth), 60.0) == 0.0


def test_what_was_removed_is_counted_from_the_truth() -> None:
    # 20 before, 8 after, 4 in the truth: 12 of 16. Floating before is within a tenth of the truth's. Distances are no artefact.
    before = {"stance_skate": 20.0, "floating": 1.05, "jitter": 0.5, "truth_error_local": 40.0}
    after = {"stance_skate": 8.0, "floating": 0.0, "jitter": 0.6, "truth_error_local": 30.0}
    truth = {"stance_skate": 4.0, "floating": 1.0, "jitter": 0.3, "truth_error_local": 0.0}
    assert removed_shares(before, after, truth) == {"stance_skate": pytest.approx(0.75), "jitter": pytest.approx(-0.5)}
