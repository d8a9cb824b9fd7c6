"""Measurement of all contacts of feet and floor while the humanoid performs clips: load, slip, depth and dissipated power."""

from typing import NamedTuple, Self

import mujoco
import numpy as np
from gymnasium.vector import AutoresetMode

from datasets.library.motion_library import MotionLibrary
from envs.mimic.episode_metrics import body_error
from envs.mimic.spec import MimicSpec
from envs.physics.engine_interface import CONTROL_STEP_S
from envs.physics.humanoid_mjcf import FOOT_BODY_IDS
from envs.physics.mujoco_cpu import CpuPhysics
from envs.vector_env import AdaptMimicVectorEnv
from trainers.evaluation.evaluation_protocol import PolicyFn

MIN_SLIP_SPEED_M_S = 0.1  # from which on a contact counts as slipping
_STATE = mujoco.mjtState.mjSTATE_INTEGRATION


class Contacts(NamedTuple):
    """C contacts of feet with the floor, each in one engine step of one world.

    Attributes:
        world: Index of the world, shape (C,).
        load: Force along the floor's normal [N], shape (C,).
        slip: Horizontal speed of the contact point of the foot [m/s], shape (C,).
        depth: Penetration depth of the contact point [m], shape (C,).
        power: Power that the contact takes from the body, force against speed [W], shape (C,).
    """

    world: np.ndarray
    load: np.ndarray
    slip: np.ndarray
    depth: np.ndarray
    power: np.ndarray

    @classmethod
    def of(cls, model: mujoco.MjModel, data: mujoco.MjData, world: int = 0) -> Self:
        """Return the contacts of one world that bear load, from data that ``mj_forward`` has filled."""
        rows, wrench = [], np.zeros(6)
        for index, bodies in enumerate(model.geom_bodyid[data.contact.geom].reshape(-1, 2)):
            body = int(bodies.max())
            if bodies.min() != 0 or body not in FOOT_BODY_IDS:
                continue
            mujoco.mj_contactForce(model, data, index, wrench)
            if wrench[0] > 0.0:
                force = data.contact.frame[index].reshape(3, 3).T @ wrench[:3] * (1.0 if bodies[0] == 0 else -1.0)  # on the foot
                arm = data.contact.pos[index] - data.subtree_com[model.body_rootid[body]]
                speed = data.cvel[body, 3:] + np.cross(data.cvel[body, :3], arm)
                rows.append((world, wrench[0], np.hypot(*speed[:2]), -data.contact.dist[index], -force @ speed))
        return cls(*np.array(rows, dtype=float).reshape(-1, 5).T)


class GroundContact(NamedTuple):
    """Measures of ground contact over the contacts of some worlds, weighted by load.

    Attributes:
        slip: Mean horizontal speed of the contact points [cm/s].
        slipping: Share of the load at points quicker than ``MIN_SLIP_SPEED_M_S``.
        depth: Mean depth [mm].
        depth_p99: 99th percentile of the contacts' depths, not weighted [mm].
        noise: Part of the feet's velocities that reverses from engine step to engine step, mean over feet, toes and steps [cm/s].
        power: Power that contacts take from the body, mean over time [W].
        contacts: Number of contacts that bear load, mean over time.
        body_error: Mean distance of the 20 bodies from the reference, roots aligned (docs/metrics.md) [mm].
        lasted: Share of the clips' duration until the episodes ended.
    """

    slip: float
    slipping: float
    depth: float
    depth_p99: float
    noise: float
    power: float
    contacts: float
    body_error: float
    lasted: float


class ContactPhysics(CpuPhysics):
    """Physics that records every contact of feet and floor at the beginning of every engine step.

    Attributes:
        active_worlds: Whether each world is recorded, shape (N,).
        contacts: Contacts so far, by engine step and world.
        foot_speeds: Velocities of feet and toes at each engine step [m/s], NaN in worlds that are not recorded, each (N, 4, 3).
    """

    def __init__(self, worlds: int, threads: int, model: mujoco.MjModel) -> None:
        """Build the simulations of a model, all of them recorded."""
        super().__init__(worlds, threads, model)
        self._data = mujoco.MjData(self.model)
        self.active_worlds = np.ones(worlds, dtype=bool)
        self.contacts: list[Contacts] = []
        self.foot_speeds: list[np.ndarray] = []

    def _advance(self) -> None:
        for _ in range(self.steps):
            speeds, velocity = np.full((len(self.active_worlds), len(FOOT_BODY_IDS), 3), np.nan), np.zeros(6)
            for world in np.flatnonzero(self.active_worlds):
                mujoco.mj_setState(self.model, self._data, self._batch.state[world], _STATE)
                mujoco.mj_forward(self.model, self._data)
                self.contacts.append(Contacts.of(self.model, self._data, int(world)))
                for place, body in enumerate(FOOT_BODY_IDS):
                    mujoco.mj_objectVelocity(self.model, self._data, mujoco.mjtObj.mjOBJ_BODY, body, velocity, 0)
                    speeds[world, place] = velocity[3:]
            self.foot_speeds.append(speeds)
            self._batch.step(nstep=1)


class ContactRecording(NamedTuple):
    """Recording of clips that were performed, one in each of N worlds, for up to one episode.

    Attributes:
        contacts: Contacts of all worlds.
        foot_speeds: Velocities of feet and toes at each engine step, NaN after a world's end [m/s], shape (K, N, 4, 3).
        body_error: Mean distance of the bodies at each control step, NaN after a world's end [m], shape (S, N).
        steps: Control steps that each world could have lasted, shape (N,).
        time_step: Time step of the engine [s].
    """

    contacts: Contacts
    foot_speeds: np.ndarray
    body_error: np.ndarray
    steps: np.ndarray
    time_step: float


def record_contacts(
    model: mujoco.MjModel, library: MotionLibrary, spec: MimicSpec, act: PolicyFn, root_force: float = 0.0
) -> ContactRecording:
    """Perform each clip from its first frame on until its episode ends, and record every contact.

    Args:
        model: Variant of ``envs.physics.humanoid_mjcf.build_model``'s model.
        library: Clips, with feed-forward angles where the task wants them.
        spec: Variant of the task.
        act: Policy.
        root_force: Largest assist force on the root along the reference [body weights].
    """
    count = len(library.clips)
    env = AdaptMimicVectorEnv(library, count, spec, 1, AutoresetMode.DISABLED, physics=lambda n, threads: ContactPhysics(n, threads, model))
    physics = env.physics
    assert isinstance(physics, ContactPhysics)
    env.assist_force_bw = root_force
    observation, _ = env.reset(options={"clip": np.arange(count), "frame": np.zeros(count, dtype=int)})
    errors = []
    while physics.active_worlds.any():
        observation, _, terminated, truncated, _ = env.step(act(observation))
        off = body_error(physics.bodies(), env.library.at(env.library_rows).observed)
        errors.append(np.where(physics.active_worlds, off, np.nan))
        physics.active_worlds &= ~(terminated | truncated)
    contacts = Contacts(*(np.concat(parts) for parts in zip(*physics.contacts, strict=True)))
    return ContactRecording(contacts, np.array(physics.foot_speeds), np.array(errors), env.episode_steps, model.opt.timestep)


def measure_ground_contact(recording: ContactRecording, worlds: np.ndarray) -> GroundContact:
    """Return the measures of ground contact in some worlds, given by their indices (n,)."""
    chosen = np.isin(recording.contacts.world, worlds)
    _, load, slip, depth, power = (part[chosen] for part in recording.contacts)
    alive = np.isfinite(recording.body_error[:, worlds])
    seconds = CONTROL_STEP_S * alive.sum()
    whole = load.sum() if load.any() else 1.0
    return GroundContact(
        slip=100.0 * float(slip @ load) / whole,
        slipping=float(load[slip > MIN_SLIP_SPEED_M_S].sum()) / whole,
        depth=1e3 * float(depth @ load) / whole,
        depth_p99=1e3 * float(np.percentile(depth, 99.0)) if len(depth) else 0.0,
        noise=100.0 * alternating_speed(recording.foot_speeds[:, worlds]),
        power=float(power.sum()) * recording.time_step / seconds,
        contacts=len(load) * recording.time_step / seconds,
        body_error=1e3 * float(np.nanmean(recording.body_error[:, worlds])),
        lasted=float(alive.sum()) / float(recording.steps[worlds].sum()),
    )


def alternating_speed(speeds: np.ndarray) -> float:
    """Return the part of velocities (K, ..., 3) that reverses from step to step: the mean length of (a - 2 b + c) / 4 of three in a row."""
    alternating = (speeds[:-2] - 2.0 * speeds[1:-1] + speeds[2:]) / 4.0
    return float(np.nanmean(np.linalg.norm(alternating, axis=-1)))
