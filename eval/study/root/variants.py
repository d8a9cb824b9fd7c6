"""Models that the root study trains, each with its overrides of a config and the thesis's values."""

from dataclasses import dataclass, field

from eval.evaluation_recordings import IMU_POSES, OPTICAL_POSES

UNET, CNN = "u-net, all", "CNN, all"
UNET_RWI, CNN_RWI = "u-net, run-walk-idle", "CNN, run-walk-idle"
ROOT_TARGET, DISPLACEMENT, UNET_IMU = "u-net, root as target", "u-net, vertical displacement", "u-net, IMU poses"
ROOT3D_OPTICAL = "Root3D, optical poses and accelerations"
ROOT3D_IMU = "Root3D, IMU poses and accelerations"
ROOT3D_ALONE = "Root3D, IMU poses alone"
MOTIONLESS, OWN_ROOT = "motionless root", "the simulated suit's own root"
PRETRAINED_OPTICAL, PRETRAINED_IMU = (f"as shipped: Root3D, {poses} poses and accelerations" for poses in ("optical", "IMU"))
WALK_OWN_ROOT, WALK_CONTACTS = "the real walk, the suit's own root", "the real walk, foot contacts"
RUN_WALK_IDLE = "run,jog,dash,walk,turn,stand"  # kinds of motion that stand for the thesis's run, walk and idle (RWI)


@dataclass(frozen=True)
class Variant:
    """Model of the study.

    Attributes:
        name: Row of the table.
        config: File in ``configs/`` without its ending.
        poses: Kind of poses for training and test.
        overrides: Overrides of the config.
        published: Values of the thesis.
    """

    name: str
    config: str
    poses: str = OPTICAL_POSES
    overrides: tuple[str, ...] = ()
    published: dict[str, float] = field(default_factory=dict)


def _table_2_1(*values: float) -> dict[str, float]:
    return dict(zip(("mu_f", "mu_l", "mu_v", "sigma_f", "sigma_l", "sigma_v"), values, strict=True))


_BY_CNN, _OF_RWI = "model.network=planar_cnn", f"data.kinds=[{RUN_WALK_IDLE}]"
# as in the thesis: its network and windows, nothing of what the package's own model adds
_PLAIN = ("model.network=root3d", "learner.batch=256", "learner.sequence=1", "learner.mask_share=0")
VARIANTS = (
    Variant(UNET, "planar", published=_table_2_1(-0.004, 0.002, -4.062, 0.191, 0.185, 23.123)),
    Variant(CNN, "planar", OPTICAL_POSES, (_BY_CNN,), _table_2_1(0.034, 0.007, -4.202, 0.211, 0.219, 24.274)),
    Variant(UNET_RWI, "planar", OPTICAL_POSES, (_OF_RWI,), _table_2_1(-0.026, 0.034, -5.886, 3.331, 0.203, 29.010)),
    Variant(CNN_RWI, "planar", OPTICAL_POSES, (_BY_CNN, _OF_RWI), _table_2_1(-0.017, -0.040, -14.582, 3.349, 0.303, 78.551)),
    Variant(ROOT_TARGET, "planar", OPTICAL_POSES, ("model.target=root",)),
    Variant(DISPLACEMENT, "planar", OPTICAL_POSES, ("model.vertical=displacement",)),
    Variant(UNET_IMU, "planar", IMU_POSES),
    Variant(ROOT3D_OPTICAL, "root3d", OPTICAL_POSES, _PLAIN, {"e_mse": 0.0041, "e_mse_std": 0.0069}),
    Variant(ROOT3D_IMU, "root3d", IMU_POSES, _PLAIN, {"e_mse": 0.0266, "e_mse_std": 0.0768}),
    Variant(ROOT3D_ALONE, "root3d", IMU_POSES, (*_PLAIN, "model.accelerations=false")),
)
