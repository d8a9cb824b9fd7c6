"""The optimisation of whole clips: who stands, who steps, who hangs in the air, and who flies off."""

from dataclasses import replace

import numpy as np
import pytest

from datasets.motion.clip import BodyMotion
from datasets.synthetic.clips import synthetic_clips
from envs.physics.mujoco_cpu import RecordingPhysics
from envs.physics.segment import Segment
from eval.clean.optimisation import receding_horizon
from eval.clean.optimisation.receding_horizon import MIN_RESTART_STEPS, TrajectoryOptimiser
from eval.clean.quality import OptimisationSettings
from eval.clean.simulate_clip import simulate_clip, write_segments
from eval.metrics.artefact_tracks import distances_local
from tests.builders import posed
from tests.eval.clean.clean_parts import simulator, standing

FEW = 2  # passes


def optimised(clip: BodyMotion, max_passes: int = FEW) -> list[Segment]:
    return list(TrajectoryOptimiser(clip, max_passes).segments())


def test_who_stands_needs_no_help() -> None:
    clip = standing(31)
    (segment,) = optimised(clip)
    assert (segment.start, segment.poses.shape, segment.targets.shape) == (0, (31, 50), (31, 43))
    assert not segment.assist.any()
    assert 1e3 * distances_local(write_segments(clip, [segment]), clip).mean() < 2.0  # mm; a search of the same clip has 15


def test_the_engine_makes_these_frames_of_these_targets() -> None:
    (segment,) = optimised(standing(21))
    physics = RecordingPhysics(1)
    physics.reset(np.array([0]), segment.poses[:1], segment.velocities[:1])
    for frame in range(1, 21, 2):
        physics.step(segment.targets[frame : frame + 1])
        assert [substate[0][0].tolist() for substate in physics.substates] == segment.poses[frame : frame + 2].tolist()


def test_who_walks_is_followed_closely() -> None:
    clip = next(clip for clip in synthetic_clips(0, 1, 6.0) if clip.kind == "walk").cut(120, 161)
    (segment,) = optimised(clip, 5)
    assert 1e3 * distances_local(write_segments(clip, [segment]), clip).mean() < 10.0  # mm
    assert np.mean(segment.assist > 0.1) < 0.2


def test_who_hangs_in_the_air_is_held_there_and_is_no_physics() -> None:
    # Half a metre above the ground nothing but help carries the body, all of its weight; a tenth is what counts as physics.
    still = posed({}, 21)
    clip = replace(still, root_position=still.root_position + np.array([0.0, 0.0, 0.5]))
    (segment,) = optimised(clip)
    assert segment.assist[2:-6].mean() == pytest.approx(1.0, abs=0.25)
    found = simulate_clip(simulator(OptimisationSettings(FEW)), clip)
    assert found.confidence.max() < 0.5
    assert not found.assist.any()


def test_who_is_lost_begins_anew() -> None:
    # The clip leaps by 5 m in a frame: nobody follows there, and what comes after begins in the clip's own state.
    still = standing(61)
    clip = replace(still, root_position=still.root_position + np.where(np.arange(61) < 12, 0.0, 5.0)[:, None] * np.array([1.0, 0.0, 0.0]))
    segments = optimised(clip)
    assert len(segments) > 1
    assert segments[-1].poses[-1, 0] == pytest.approx(5.0, abs=0.1)
    assert segments[-1].start + len(segments[-1].poses) == 61
    assert min(np.diff([one.start for one in segments])) >= 2 * MIN_RESTART_STEPS


def test_windows_join_without_a_seam(monkeypatch: pytest.MonkeyPatch) -> None:
    # Longer than a window: what is kept of the first ends where the second begins, at the same pose.
    monkeypatch.setattr(receding_horizon, "WINDOW_STEPS", 15)
    monkeypatch.setattr(receding_horizon, "KEPT_STEPS", 10)
    frames = 2 * 20 + 1
    told: list[int] = []
    (segment,) = TrajectoryOptimiser(standing(frames), FEW, after_frames=told.append).segments()
    assert len(segment.poses) == frames
    assert told == [20, 20]
    speeds = np.abs(np.diff(segment.poses[:, 7:], axis=0)).max(axis=1)
    assert speeds[18:23].max() < 1.5 * np.median(speeds) + 1e-3


def test_it_comes_again_to_the_bit() -> None:
    one, other = (optimised(standing(21))[0] for _ in range(2))
    assert all(np.array_equal(a, b) for a, b in zip(one[1:], other[1:], strict=True))


def test_a_plan_goes_on_from_where_the_window_before_ended() -> None:
    # Two steps were simulated, and the clip is planned after them: from the end of the second step to the clip there is a gap, before it
    # none.
    clip = standing(13)
    optimiser = TrajectoryOptimiser(clip, FEW)
    whole = optimiser._solve(0, optimiser._cost.weights(0, 7), optimiser._world_at(*optimiser._cost.wanted(0)), None)
    assert whole.num_simulated == 6
    rest = receding_horizon.Trajectory(whole.poses[:3], whole.velocities[:3], whole.inputs[:2], whole.worlds[:3])
    plan = optimiser._plan(0, 6, rest)
    assert plan.num_simulated == 2
    assert plan.poses[2].tolist() == whole.poses[2].tolist()
    assert plan.poses[3:].tolist() == optimiser._cost.poses[3:].tolist()
    _, gaps = optimiser._linearise(0, plan)
    assert not gaps[:2].any()
    assert np.abs(gaps[2:]).max(axis=1).min() > 1e-6
