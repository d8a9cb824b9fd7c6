"""Simulation by mujoco-warp: failures, resets, and worlds left alone."""

import numpy as np
import pytest
import torch

from configs.errors import InputError
from datasets.library.motion_library import MotionLibrary
from envs.physics import mujoco_warp as physics_warp
from envs.physics.mujoco_warp import WarpPhysics, import_warp
from eval.backends.exact_physics import exact_cpu_physics
from tests.envs.devices import DEVICES, assert_same

ROWS = np.array([40, 200, 500, 600])


def placed(library: MotionLibrary, device: torch.device) -> WarpPhysics:
    """Return four worlds on their references."""
    physics = WarpPhysics(4, device)
    everybody = torch.ones(4, dtype=torch.bool, device=device)
    physics.reset(everybody, torch.tensor(library.start_pose[ROWS], device=device), torch.tensor(library.start_vel[ROWS], device=device))
    return physics


def targets(library: MotionLibrary, device: torch.device) -> torch.Tensor:
    return torch.tensor(library.at(ROWS).observed.hinges, device=device)


@DEVICES
def test_torch_and_warp_share_memory(library: MotionLibrary, device: torch.device) -> None:
    physics = placed(library, device)
    for name, tensor in physics._shared.items():
        assert tensor.data_ptr() == getattr(physics._data, name).ptr, name


@DEVICES
def test_worlds_that_explode_are_put_back_and_harm_nobody(library: MotionLibrary, device: torch.device) -> None:
    sound, harmed = placed(library, device), placed(library, device)
    harmed._shared["qvel"][1, 7] = torch.nan
    harmed._shared["qvel"][2, 3:6] = 1e6
    assert not sound.step(targets(library, device)).any()
    assert harmed.step(targets(library, device)).tolist() == [False, True, True, False]
    for one, other in zip(sound.bodies(), harmed.bodies(), strict=True):
        assert_same(one[[0, 3]], other[[0, 3]])
        assert other.isfinite().all()
    assert harmed.bodies().lin_vel[[1, 2]].abs().max() == 0.0
    rest = torch.tensor(harmed.model.qpos0, dtype=torch.float32, device=device)
    assert torch.equal(harmed.get_state()["qpos"][1:3], rest.expand(2, -1))
    # Nothing is left of it: in the next step all are sound.
    assert not harmed.step(targets(library, device)).any()


@DEVICES
def test_a_world_with_more_contacts_than_there_is_room_for_has_failed(
    library: MotionLibrary, device: torch.device, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Four corners of a foot and of its toes, both sides, four edges of friction each: 64 rows. In the air there are none.
    monkeypatch.setattr(physics_warp, "MAX_CONSTRAINT_ROWS", 32)
    physics = placed(library, device)
    state = physics.get_state()
    state["qpos"][:3, 2] += 0.5
    physics.set_state(state)
    assert physics.step(targets(library, device)).tolist() == [False, False, False, True]


@DEVICES
def test_a_force_on_the_root_acts_as_on_the_cpu(library: MotionLibrary, device: torch.device) -> None:
    wrench = np.array([[0.0, 0.0, 1500.0, 0.0, 0.0, 0.0], [300.0, 0.0, 0.0, 0.0, 90.0, 0.0], [0.0] * 6, [0.0, -200.0, 0.0, 50.0, 0.0, 0.0]])
    ours, other = exact_cpu_physics(4), placed(library, device)
    ours.reset(np.arange(4), library.start_pose[ROWS], library.start_vel[ROWS])
    ours.set_root_wrench(wrench)
    other.set_root_wrench(torch.tensor(wrench, dtype=torch.float32, device=device))
    before = other.bodies().pos[0, 0, 2].item()
    for _ in range(3):
        ours.step(library.at(ROWS).observed.hinges)
        other.step(targets(library, device))
    # 1500 N lift 68 kg, 667 N, by 12 m/s^2: 6 cm in a tenth of a second.
    assert other.bodies().pos[0, 0, 2].item() - before == pytest.approx(0.06, abs=0.03)
    np.testing.assert_allclose(other.bodies().pos.cpu().numpy(), ours.bodies().pos, atol=1e-4)


@DEVICES
def test_a_state_can_be_gone_back_to(library: MotionLibrary, device: torch.device) -> None:
    physics = placed(library, device)
    physics.step(targets(library, device))
    state = physics.get_state()
    runs = []
    for _ in range(2):
        physics.set_state(state)
        physics.step(targets(library, device))
        runs.append(physics.bodies())
    for one, other in zip(*runs, strict=True):
        assert_same(one, other)


@DEVICES
def test_only_the_chosen_worlds_are_reset(library: MotionLibrary, device: torch.device) -> None:
    physics = placed(library, device)
    physics.step(targets(library, device))
    before = physics.get_state()
    chosen = torch.tensor([False, True, False, False], device=device)
    pose, vel = (torch.tensor(array[[0, 0, 0, 0]], device=device) for array in (library.start_pose, library.start_vel))
    physics.reset(chosen, pose, vel)
    after = physics.get_state()
    assert torch.equal(after["qpos"][1], pose[1])
    assert after["qacc_warmstart"][1].abs().max() == 0.0
    for name in ("qpos", "qvel", "qacc_warmstart"):
        assert torch.equal(after[name][~chosen], before[name][~chosen])


def test_without_the_package_there_is_one_clear_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(physics_warp, "find_spec", lambda _: None)
    with pytest.raises(InputError, match=r"mujoco-warp is not installed; should be cpu, or install it: pip install '\.\[gpu\]'"):
        import_warp(torch.device("cpu"))


def test_a_driver_that_is_too_old_is_one_clear_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("warp.is_cuda_available", lambda: False)
    with pytest.raises(InputError, match=r"warp cannot use its driver; should be one for CUDA 13 \(580 or newer\)"):
        import_warp(torch.device("cuda"))
