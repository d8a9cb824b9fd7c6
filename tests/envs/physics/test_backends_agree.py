"""MuJoCo and mujoco-warp do the same: over single steps within tolerances, over episodes on average.

Known differences of the two engines, beside single precision and a solver that stops at 1e-6 instead of 1e-8:

- What is contact within rounding is contact in one of them only: in one control step of a hundred. A start that touched the ground at
  exactly 0 used to be one, and made episodes of an unsteady policy differ by 0.02 of their length; now starts are 0.1 mm in the ground.
- Capsules that lie along each other, and friction on the verge of slipping, come out differently in one step of a few hundred.
- Two convex shapes would meet in other points; boxes do not, because mujoco-warp is told to treat them as boxes.

``python -m eval.backends`` prints the figures.
"""

import numpy as np
import torch

from datasets.library.motion_library import MotionLibrary
from envs.mimic.spec import MimicSpec
from eval.backends.episodes import COMPARED_METRICS, episode_pairs
from eval.backends.steps import ALIKE, CAUSES, TOUCHING, StepDifferences, step_differences
from tests.envs.devices import DEVICES
from trainers.evaluation.evaluation_protocol import zero_residual

EVERYTHING = MimicSpec(
    frame="heading",
    com_error=True,
    com_height=True,
    preview=(1, 3),
    action_scale=3.0,
    feed_forward=True,
    foot_slip=0.1,
    action_rate=0.1,
)


def steps(library: MotionLibrary, spec: MimicSpec, device: torch.device) -> StepDifferences:
    return step_differences(library, spec, 32, 30, device)


@DEVICES
def test_single_steps_agree(library: MotionLibrary, device: torch.device) -> None:
    # Velocities of single precision after four engine steps: 1e-4 m/s where hands move at 10 m/s.
    found = steps(library, EVERYTHING, device)
    alike = found.of(ALIKE)
    assert len(alike.reward) > 0.9 * len(found.reward)
    assert np.percentile(alike.observation, 50) < 2e-5
    assert np.percentile(alike.observation, 99) < 5e-4
    assert np.percentile(alike.reward, 99) < 1e-5
    assert not alike.ended.any()


@DEVICES
def test_known_differences_stay_small(library: MotionLibrary, device: torch.device) -> None:
    found = steps(library, MimicSpec(configuration="full", action_scale=3.0), device)
    assert found.observation.max() < 10.0  # m/s, of one of 20 bodies
    assert found.reward.max() < 0.3  # of 3
    assert found.ended.mean() < 0.005
    for kind in set(CAUSES) - {ALIKE}:
        assert (found.kind == kind).mean() < 0.1


@DEVICES
def test_starts_leave_nothing_to_rounding(library: MotionLibrary, device: torch.device) -> None:
    # Of three clips that stand on the ground or 1 cm in it. Were starts within rounding of the ground, all would be "touching"; that a
    # corner of a box comes so near in one of the eight engine steps after a start happens to one in eight.
    found = step_differences(library, MimicSpec(), 64, 1, device)
    assert (found.kind == TOUCHING).mean() < 0.25
    assert found.of(ALIKE).observation.max() < 1e-4


@DEVICES
def test_episodes_go_the_same_way(library: MotionLibrary, device: torch.device) -> None:
    # Episodes that begin alike end alike as long as nobody stumbles; those that do not must differ about 0.
    spec = MimicSpec(action_scale=3.0)
    rng = np.random.default_rng(3)
    tremble = rng.uniform(-0.4, 0.4, (spec.observation_size, spec.action_size)).astype(np.float32)
    for act in (zero_residual(spec), lambda seen: np.sin(seen @ tremble)):
        pairs = episode_pairs(act, library, spec, 24, device)
        assert not np.isnan(pairs.warp["episode_length_ratio"]).any()
        assert pairs.cpu["episode_length_ratio"].std() > 0.05  # not all the same
        for name in COMPARED_METRICS:
            difference, error = pairs.difference(name)
            assert abs(difference) <= (3.0 if device.type == "cpu" else 5.0) * error + 1e-3, name  # a GPU throws the dice anew each time
        assert abs(pairs.difference("episode_length_ratio")[0]) < 0.03
        assert abs(pairs.difference("max_reward_ratio")[0]) < 0.03
