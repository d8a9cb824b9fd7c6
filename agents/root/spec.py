"""Specification of a root model: network, inputs and targets."""

from dataclasses import dataclass
from math import inf

from agents.root.networks import planar_unet, root3d_unet
from agents.root.networks.gru import GruNetwork
from agents.root.networks.planar_cnn import PlanarCnn
from agents.root.networks.planar_unet import PlanarUnet
from agents.root.networks.root3d_unet import Root3dUnet
from agents.root.recurrent import patches
from configs.errors import InputError
from datasets.imu.root_features import STANCE_BODIES
from datasets.imu.sensor_model import SENSOR_BODIES
from datasets.motion.humanoid import BODY_COUNT

NETWORKS = {"gru": GruNetwork, "root3d": Root3dUnet, "planar_unet": PlanarUnet, "planar_cnn": PlanarCnn}
# m/s, up to which the stance filter keeps feet from sliding under the path of the recurrent model. That model knows a suit's steps to be
# too short: a walk whose feet are kept still would have steps of the suit's length again.
RECURRENT_SLIDE_SPEED_M_S = 0.08
PLANAR_FEATURES = 64  # 19 joints are 57 numbers, padded with zeros (thesis 2.4.3)


@dataclass(frozen=True)
class RootSpec:
    """One variant of the root model.

    Attributes:
        network: Network: "gru" remembers the performance and filters the velocity (``agents.root.recurrent``), "root3d" predicts steps
            ahead from windows of 8 frames (thesis), "planar_unet" and "planar_cnn" a path along windows of 64.
        accelerations: Whether a Root3D sees the sensors' accelerations beside the joints (thesis 3.5.4).
        target: Point whose path is predicted: "root" or "com".
        vertical: Vertical target: "displacement" along the window as in the horizontal plane, or absolute "height" (planar networks only).
        support: Whether the network "root3d" also predicts which points of the feet carry the body, and its path is added to the one about
            those (``agents.root.stance_points``); not in the thesis. The recurrent one always does.
    """

    network: str = "root3d"
    accelerations: bool = True
    target: str = "root"
    vertical: str = "displacement"
    support: bool = False

    def __post_init__(self) -> None:
        """Check the values."""
        for name, known in (("network", tuple(NETWORKS)), ("target", ("root", "com")), ("vertical", ("displacement", "height"))):
            if getattr(self, name) not in known:
                raise InputError(f"model.{name} is '{getattr(self, name)}', should be {' or '.join(known)}")
        if not self.is_planar and self.vertical == "height":
            raise InputError(f"model.vertical is 'height', should be displacement: {self.network} predicts steps")
        if self.is_recurrent and self.target == "com":
            raise InputError("model.target is 'com', should be root: gru predicts the pelvis' steps")
        if not self.predicts_steps_ahead and self.support:
            raise InputError("model.support is true, should be false: only root3d predicts stance points by choice")
        if self.is_planar and self.accelerations:
            raise InputError("model.accelerations is true, should be false: planar networks see the pose only")

    @property
    def predicts_steps_ahead(self) -> bool:
        """Whether the network predicts mini-trajectories ahead of a window's first frame instead of the path along the window."""
        return self.network == "root3d"

    @property
    def is_recurrent(self) -> bool:
        """Whether the network remembers what came before its window."""
        return self.network == "gru"

    @property
    def is_planar(self) -> bool:
        """Whether the network is one of the planar ones, which see joints alone."""
        return self.network.startswith("planar")

    @property
    def slide_speed(self) -> float:
        """Speed under the predicted path up to which the stance filter keeps feet from sliding [m/s]."""
        return RECURRENT_SLIDE_SPEED_M_S if self.is_recurrent else inf

    @property
    def window(self) -> int:
        """Number of frames of a window."""
        if self.is_recurrent:
            return patches.WINDOW_FRAMES
        return root3d_unet.WINDOW_FRAMES if self.predicts_steps_ahead else planar_unet.WINDOW_FRAMES

    @property
    def bodies(self) -> tuple[int, ...]:
        """Body of each vector in the features of a frame, or of a patch: joints, then sensors."""
        if self.is_recurrent:
            return patches.patch_bodies(self.accelerations)
        if self.is_planar:
            return tuple(range(1, BODY_COUNT))
        return (*range(BODY_COUNT), *(SENSOR_BODIES if self.accelerations else ()))

    @property
    def features(self) -> int:
        """Number of features of a frame: 117 with accelerations, 60 without (docs/errata.md, eq. 3.23), 64 for the planar networks.

        Of a patch of the recurrent network: 294 and 180.
        """
        return PLANAR_FEATURES if self.is_planar else 3 * len(self.bodies)

    @property
    def outputs(self) -> int:
        """Number of outputs of a frame: three coordinates, then a logit for each point of support; of a patch those of the filter."""
        return patches.OUTPUT_COUNT if self.is_recurrent else 3 + self.support * len(STANCE_BODIES)
