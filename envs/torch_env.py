"""The vector env of a GPU: thousands of mimicking humanoids on one device, tensors in and out, nothing copied to the host."""

from typing import Any

import torch
from gymnasium.vector import AutoresetMode

from datasets.library.motion_library import MotionLibrary
from envs.base_vector_env import MimicVectorEnvBase
from envs.mimic.spec import EPISODE_FRAMES, MimicSpec
from envs.physics.mujoco_warp import WarpPhysics, masked_where


class AdaptMimicTorchEnv(MimicVectorEnvBase):
    """N humanoids that mimic the clips of a library, simulated by mujoco-warp; what is seen and rewarded is the native env's own code.

    It differs from the native env in three points. Everything is a tensor on the device, spaces and info included. Autoreset is
    same-step, always; ``final_obs`` and ``tracking`` are in every info, and their masks say whose ended. An action that is no number,
    of which nobody could be told without waiting for the device, fails its world as exploded physics does: it is reset and counted.
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
            clip_weights: How often each clip is drawn; by length if None, shape (clips,).
            adaptive_starts: Whether episodes begin more often where they fail, instead of at any frame alike.

        Raises:
            ValueError: If the library's rate is not 60 fps.
            InputError: If mujoco-warp is not installed.
        """
        self.device = torch.device(device)
        self.physics = WarpPhysics(num_envs, self.device)
        super().__init__(library, num_envs, task, AutoresetMode.SAME_STEP, clip_weights, adaptive_starts, self._placed)
        self.physics_failures = torch.zeros((), dtype=torch.int64, device=self.device)
        self._chance = torch.Generator(self.device)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[torch.Tensor, dict[str, Any]]:
        """Begin an episode in every world.

        Args:
            seed: Of the start frames drawn from now on; what the sampler learnt is forgotten, so that on the CPU a seed means one run. A
                GPU adds numbers up in another order each time.
            options: ``clip`` and ``frame`` (N,), where worlds begin instead of at random.

        Returns:
            Observations (N, O) and an empty info.

        Raises:
            ValueError: If the options hold anything else, or name a clip or a frame that is none.
        """
        if seed is not None:
            self._chance.manual_seed(seed)
            self.start_sampler.reset()
        where = self._placed_starts(options) if options else self._draw()
        self._begin(torch.ones(self.num_envs, dtype=torch.bool, device=self.device), *where)
        return self._look(), {}

    def step(self, actions: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor, torch.Tensor, dict[str, Any]]:
        """Advance every world by one control step of 1/30 s.

        Args:
            actions: In [-1, 1], clipped to it, shape (N, A).

        Returns:
            Observations (N, O), rewards (N,), terminated (N,), truncated (N,), and the info: reward terms by name (N,),
            ``physics_failed`` (N,), and ``final_obs`` and ``tracking`` with the masks of the worlds that ended.
        """
        last, outcome, info = self._advance(actions.nan_to_num(0.0).clip(-1.0, 1.0), actions.isnan().any(dim=1))
        ended = outcome.ended
        self._learn_starts(slice(None), outcome.terminated, ended)
        info |= {"final_obs": last, "_final_obs": ended, "tracking": self._tracking(), "_tracking": ended}
        self._begin(ended, *self._draw())
        return masked_where(ended, self._look(), last), outcome.rewards, outcome.terminated, outcome.truncated, info

    def get_state(self) -> dict[str, Any]:
        """Return everything that the future of this env depends on, as NumPy arrays and plain values."""
        tensors = {**self._arrays(), **{f"physics/{name}": part for name, part in self.physics.get_state().items()}}
        return {
            **{name: tensor.cpu().numpy().copy() for name, tensor in tensors.items()},
            "physics_failures": int(self.physics_failures),
            "random": self._chance.get_state().numpy(),
        }

    def set_state(self, state: dict[str, Any]) -> torch.Tensor:
        """Go back to a state that ``get_state`` returned; return the observations (N, O) there."""
        tensors = {name: torch.tensor(state[name], device=self.device) for name in state if name not in ("physics_failures", "random")}
        self.physics.set_state({name.removeprefix("physics/"): part for name, part in tensors.items() if name.startswith("physics/")})
        self._set_arrays(tensors)
        self.physics_failures.fill_(state["physics_failures"])
        self._chance.set_state(torch.tensor(state["random"]))
        return self._look()

    def _placed(self, array: Any) -> torch.Tensor:
        """Return a copy of an array on the device."""
        return torch.tensor(array, device=self.device)

    def _look(self) -> torch.Tensor:
        """Return the observations of all worlds, shape (N, O)."""
        return self._observe(self.physics.bodies(), self.library.at(self._row))

    def _placed_starts(self, options: dict[str, Any]) -> tuple[torch.Tensor, torch.Tensor]:
        """Return the starts that a caller wants; checked here, for the device would fail for good."""
        if set(options) != {"clip", "frame"}:
            raise ValueError(f"options are {', '.join(sorted(options))}, should be clip and frame of every world")
        clip, frame = (torch.as_tensor(options[name]).cpu() for name in ("clip", "frame"))
        self.start_sampler.check(clip.numpy(), frame.numpy())
        return clip.to(self.device), frame.to(self.device)

    def _draw(self) -> tuple[torch.Tensor, torch.Tensor]:
        """Return a random start for every world: clips (N,) and frames within them (N,)."""
        return self.start_sampler.sample(torch.rand((2, self.num_envs), generator=self._chance, device=self.device, dtype=torch.float64))

    def _begin(self, worlds: torch.Tensor, clip: torch.Tensor, frame: torch.Tensor) -> None:
        """Put the worlds of a mask (N,) onto the reference at the given frames (N,); the others' frames are not looked at."""
        row = self._clip_start[clip] + frame
        start = self.library.at(row)
        anew = {
            "_clip": clip,
            "_first": row,
            "_row": row,
            "_last": torch.minimum(row + EPISODE_FRAMES, self._clip_end[clip]),
            "_anchor": start.observed.pos[:, 0] - start.truth_root,
            "_action": torch.zeros_like(self._action),
        }
        for name, begun in anew.items():
            setattr(self, name, masked_where(worlds, begun, getattr(self, name)))
        self._metrics.reset(worlds)
        self.physics.reset(worlds, self.library.start_pose[row], self.library.start_vel[row])
