"""Vector env on a GPU: thousands of mimicking humanoids on one device, tensors in and out, nothing copied to the host."""

from typing import Any

import torch
from gymnasium.vector import AutoresetMode

from datasets.library.motion_library import MotionLibrary
from envs.base_vector_env import MimicVectorEnvBase
from envs.mimic.spec import EPISODE_FRAMES, MimicSpec
from envs.physics.mujoco_warp import WarpPhysics, masked_where
from envs.world_state import WorldState


class AdaptMimicTorchEnv(MimicVectorEnvBase):
    """N humanoids that mimic the clips of a library, simulated by mujoco-warp; observations and rewards are the native env's code.

    It differs from the native env in three points. All arrays are tensors on the device, those of the info included. Autoreset is
    same-step, always; ``final_obs``, ``final_info`` and ``tracking`` are in every info, and their masks tell which episodes ended. An
    action that is NaN, which could not be reported without waiting for the device, fails its world as exploded physics does: it is reset
    and counted.
    """

    def __init__(
        self,
        library: MotionLibrary,
        num_envs: int = 4096,
        task: MimicSpec | None = None,
        device: torch.device | str = "cpu",
        clip_weights: Any = None,
        adaptive_starts: bool = False,
    ) -> None:
        """Build the simulations.

        Args:
            library: Reference motion at 60 fps.
            num_envs: Number of worlds N.
            task: Variant of the task, the thesis's by default.
            device: A GPU, or the CPU.
            clip_weights: Sampling weight of each clip, shape (clips,); by length if None.
            adaptive_starts: Whether episodes begin more often where they fail, instead of at every frame equally often.

        Raises:
            ValueError: If the library's rate is not 60 fps.
            InputError: If mujoco-warp is not installed.
        """
        self.device = torch.device(device)
        self.physics = WarpPhysics(num_envs, self.device)
        super().__init__(library, num_envs, task, AutoresetMode.SAME_STEP, clip_weights, adaptive_starts, self._to_device)
        self.physics_failures = torch.zeros((), dtype=torch.int64, device=self.device)
        self._generator = torch.Generator(self.device)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[torch.Tensor, dict[str, Any]]:
        """Begin an episode in every world.

        Args:
            seed: Seed of the start frames drawn from now on; failure rates are reset, so that on the CPU a seed determines the run. A
                GPU adds numbers up in another order each time.
            options: ``clip`` and ``frame``, where each world begins instead of at random, both (N,).

        Returns:
            Observations (N, O) and an empty info.

        Raises:
            ValueError: If the options hold anything else, or a clip or frame that does not exist.
        """
        if seed is not None:
            self._generator.manual_seed(seed)
            self.start_sampler.reset()
        where = self._checked_starts(options) if options else self._draw()
        self._begin(torch.ones(self.num_envs, dtype=torch.bool, device=self.device), *where)
        return self._observe_all(), {}

    def step(self, actions: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor, torch.Tensor, dict[str, Any]]:
        """Advance every world by one control step of 1/30 s.

        Args:
            actions: Actions, clipped to [-1, 1], shape (N, A).

        Returns:
            Observations (N, O), rewards (N,), terminated (N,), truncated (N,), and the info: reward terms by name (N,),
            ``physics_failed`` (N,), and ``final_obs``, ``final_info`` and ``tracking`` with the masks of the worlds that ended.
        """
        last, outcome, info = self._advance(actions.nan_to_num(0.0).clip(-1.0, 1.0), actions.isnan().any(dim=1))
        ended = outcome.ended
        self._learn_starts(slice(None), outcome.terminated, ended)
        info |= {"tracking": self._tracking(), "_tracking": ended}
        info |= {"final_info": info.copy(), "_final_info": ended, "final_obs": last, "_final_obs": ended}
        self._begin(ended, *self._draw())
        return masked_where(ended, self._observe_all(), last), outcome.rewards, outcome.terminated, outcome.truncated, info

    def get_state(self) -> dict[str, Any]:
        """Return everything that later steps depend on, as NumPy arrays and plain values."""
        tensors = {**self._arrays(), **{f"physics/{name}": part for name, part in self.physics.get_state().items()}}
        return {
            **{name: tensor.cpu().numpy().copy() for name, tensor in tensors.items()},
            "physics_failures": int(self.physics_failures),
            "random": self._generator.get_state().numpy(),
        }

    def set_state(self, state: dict[str, Any]) -> torch.Tensor:
        """Restore a state that ``get_state`` returned; return its observations (N, O)."""
        tensors = {name: torch.tensor(state[name], device=self.device) for name in state if name not in ("physics_failures", "random")}
        self.physics.set_state({name.removeprefix("physics/"): part for name, part in tensors.items() if name.startswith("physics/")})
        self._set_arrays(tensors)
        self.physics_failures.fill_(state["physics_failures"])
        self._generator.set_state(torch.tensor(state["random"]))
        return self._observe_all()

    def _to_device(self, array: Any) -> torch.Tensor:
        """Return a copy of an array on the device."""
        return torch.tensor(array, device=self.device)

    def _observe_all(self) -> torch.Tensor:
        """Return the observations of all worlds, shape (N, O)."""
        return self._observe(self.physics.bodies(), self.library.at(self._state.row))

    def _checked_starts(self, options: dict[str, Any]) -> tuple[torch.Tensor, torch.Tensor]:
        """Return the clips (N,) and frames (N,) of a caller's options, checked: a bad index would break the device for good."""
        if set(options) != {"clip", "frame"}:
            raise ValueError(f"options are {', '.join(sorted(options))}, should be clip and frame of every world")
        clip, frame = (torch.as_tensor(options[name]).cpu() for name in ("clip", "frame"))
        self.start_sampler.check(clip.numpy(), frame.numpy())
        return clip.to(self.device), frame.to(self.device)

    def _draw(self) -> tuple[torch.Tensor, torch.Tensor]:
        """Return a random start for every world: clips (N,) and frames within them (N,)."""
        return self.start_sampler.sample(torch.rand((2, self.num_envs), generator=self._generator, device=self.device, dtype=torch.float64))

    def _begin(self, worlds: torch.Tensor, clip: torch.Tensor, frame: torch.Tensor) -> None:
        """Put the worlds of a mask (N,) onto the reference at frames (N,) of clips (N,); values of other worlds are ignored."""
        begun, _ = self._start_states(clip, frame, EPISODE_FRAMES)
        self._state = WorldState(*(masked_where(worlds, new, old) for new, old in zip(begun, self._state, strict=True)))
        self._metrics.reset(worlds)
        self.physics.reset(worlds, self.library.start_pose[begun.row], self.library.start_vel[begun.row])
