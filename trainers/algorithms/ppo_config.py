"""Configuration of a PPO training; the defaults are Table 4.3 of the thesis, files in ``configs/`` change them."""

from dataclasses import dataclass, field
from typing import ClassVar

from configs.errors import require
from configs.load import formerly
from envs.mimic.spec import MimicSpec
from trainers.algorithms.schedules import linear_schedule
from trainers.data.motion_config import DataConfig
from trainers.runs.run_config import RunConfig


@dataclass(frozen=True)
class NetworkConfig:
    """Multilayer perceptrons of policy and value.

    Attributes:
        hidden: Sizes of the hidden layers.
        activation: Activation of the hidden layers: "tanh", "elu", "silu" or "relu".
    """

    hidden: tuple[int, ...] = (1024, 1024, 512)
    activation: str = "tanh"

    def __post_init__(self) -> None:
        """Check the values; OmegaConf passes lists instead of tuples."""
        object.__setattr__(self, "hidden", tuple(self.hidden))
        require(bool(self.hidden) and min(self.hidden) > 0, "network.hidden", list(self.hidden), "positive layer sizes")
        require(self.activation in ("tanh", "elu", "silu", "relu"), "network.activation", self.activation, "tanh, elu, silu or relu")


@dataclass(frozen=True)
class CollectConfig:
    """Settings of the collection of rollouts.

    Attributes:
        actors: Number of Ray actors, each with its own envs; 0 collects in the learner's process, without Ray.
        envs: Number of worlds of each actor.
        threads: Number of native threads of each actor that step its worlds.
        horizon: Number of steps of each world in a rollout.
        assist_force_bw: Largest external force that pulls the root to the reference at the start [body weights]; it fades to zero by
            the middle of the training.
        max_body_error_m: Mean distance of the bodies from the rewarded track, roots aligned, at which an episode of the training ends as a
            fall does [m]; 0 ends none. Evaluations never end so.
        overlap: Whether actors collect the next rollout while the learner learns from the last, with the weights of one update before.
    """

    actors: int = 1
    envs: int = 4096
    threads: int = 2
    horizon: int = 16
    assist_force_bw: float = formerly("assist", 0.0)
    max_body_error_m: float = 0.0
    overlap: bool = False

    def __post_init__(self) -> None:
        """Check the values."""
        require(self.actors >= 0, "collect.actors", self.actors, "0 or more")
        for name in ("envs", "threads", "horizon"):
            require(getattr(self, name) >= 1, f"collect.{name}", getattr(self, name), "1 or more")
        require(self.assist_force_bw >= 0.0, "collect.assist_force_bw", self.assist_force_bw, "0 or more [body weights]")
        require(self.max_body_error_m >= 0.0, "collect.max_body_error_m", self.max_body_error_m, "0 or more [m]")
        require(not self.overlap or self.actors >= 1, "collect.overlap", "true without actors", "false, or collect.actors 1 or more")


@dataclass(frozen=True)
class RayConfig:
    """Placement of Ray's actors.

    Attributes:
        address: Address of a running cluster, such as "auto" for the one that this machine is part of: its nodes are sent the package,
            and the learner goes where there are cores for it. If empty, the actors run on this machine, and the learner in this process.
    """

    address: str = ""


@dataclass(frozen=True)
class LearnerConfig:
    """Settings of the policy's updates.

    Attributes:
        gamma: Discount factor.
        gae_lambda: Lambda of generalised advantage estimation.
        clip_range: Largest deviation of PPO's probability ratio from 1, beyond which it is clipped.
        epochs: Number of passes over each batch.
        minibatch: Number of samples in a minibatch.
        learning_rate: Adam's learning rate at the start.
        final_learning_rate: Adam's learning rate at the end; linear in between.
        action_std: Standard deviation of the actions at the start, not learnt (variance 0.03 in the thesis).
        final_action_std: Standard deviation of the actions at the end; linear in between.
        value_weight: Weight of the value's loss beside the policy's.
        max_grad_norm: Largest norm of the gradient, beyond which it is scaled down.
        target_kl: KL divergence at which an update's passes end; 0 never ends them.
        threads: Number of torch threads.
    """

    REMOVED_KEYS: ClassVar[dict[str, object]] = {"style": 0.0}

    gamma: float = 0.99
    gae_lambda: float = 0.95
    clip_range: float = formerly("clip", 0.2)
    epochs: int = 6
    minibatch: int = 16384
    learning_rate: float = 5e-5
    final_learning_rate: float = 5e-5
    action_std: float = formerly("sigma", 0.03**0.5)
    final_action_std: float = formerly("final_sigma", 0.03**0.5)
    value_weight: float = 1.0
    max_grad_norm: float = 1.0
    target_kl: float = 0.0
    threads: int = 2

    def __post_init__(self) -> None:
        """Check the values."""
        for name in ("gamma", "gae_lambda"):
            require(0.0 <= getattr(self, name) <= 1.0, f"learner.{name}", getattr(self, name), "from 0 to 1")
        for name in ("clip_range", "learning_rate", "action_std", "final_action_std", "max_grad_norm"):
            require(getattr(self, name) > 0.0, f"learner.{name}", getattr(self, name), "above 0")
        for name in ("epochs", "minibatch", "threads"):
            require(getattr(self, name) >= 1, f"learner.{name}", getattr(self, name), "1 or more")

    def action_std_at(self, progress: float) -> float:
        """Return the actions' standard deviation at a ``progress`` from 0 to 1."""
        return linear_schedule(self.action_std, self.final_action_std, progress)

    def learning_rate_at(self, progress: float) -> float:
        """Return Adam's learning rate at a ``progress`` from 0 to 1."""
        return linear_schedule(self.learning_rate, self.final_learning_rate, progress)


@dataclass(frozen=True, kw_only=True)
class PpoConfig(RunConfig):
    """One training run of a policy, whose samples are control steps; an iteration collects a rollout and updates the policy.

    Attributes:
        data: Motion.
        task: Variant of the task.
        network: Policy and value.
        collect: Rollouts.
        learner: Updates.
        ray: Placement of actors.
        physics: Physics backend: "cpu", MuJoCo on threads and Ray's actors, or "warp", mujoco-warp on the device, where then
            everything happens: worlds, policy and learner, in one process without actors.
        device: Device of the learner: "cpu", "cuda", or "auto", the GPU where there is one.
        init: Policy file that the training begins with, its normaliser included; a fresh policy if empty.
    """

    name: str = "run"
    data: DataConfig = field(default_factory=DataConfig)
    task: MimicSpec = field(default_factory=MimicSpec)
    network: NetworkConfig = field(default_factory=NetworkConfig)
    collect: CollectConfig = field(default_factory=CollectConfig)
    learner: LearnerConfig = field(default_factory=LearnerConfig)
    ray: RayConfig = field(default_factory=RayConfig)
    physics: str = "cpu"
    device: str = "auto"
    samples: int = 2_293_760_000  # 35,000 epochs of 65,536
    evaluate_every: int = 400
    checkpoint_every: int = 50
    init: str = ""

    def __post_init__(self) -> None:
        """Check the values."""
        super().__post_init__()
        require(
            not self.ray.address or self.collect.actors >= 1,
            "ray.address",
            f"'{self.ray.address}' without actors",
            "given with collect.actors 1 or more",
        )
        require(self.physics in ("cpu", "warp"), "physics", f"'{self.physics}'", "cpu or warp")
        require(self.device in ("auto", "cpu", "cuda"), "device", f"'{self.device}'", "auto, cpu or cuda")
        if self.physics == "warp":
            require(not self.ray.address, "ray.address", f"'{self.ray.address}' with physics warp", "empty: one process holds all worlds")
            require(not self.collect.overlap, "collect.overlap", "true with physics warp", "false: one device does everything in turn")

    @property
    def in_process(self) -> bool:
        """Whether collecting happens in the learner's process, without Ray."""
        return self.collect.actors == 0 or self.physics == "warp"
