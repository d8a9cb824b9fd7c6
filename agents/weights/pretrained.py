"""The trained models in the package; ``agents/weights/README.md`` says what each was trained on."""

from functools import cache

from agents.root.model import RootModel
from configs.source_code import ROOT

WEIGHTS = ROOT / "agents" / "weights"
SHIPPED_POLICY = WEIGHTS / "mimic.safetensors"
SHIPPED_LOBSTR = WEIGHTS / "lobstr.safetensors"


@cache
def shipped_root_model(name: str) -> RootModel:
    """Return a trained root model of the package.

    Args:
        name: "root3d", "root3d_pose" or "planar".

    Raises:
        InputError: If the package holds no such model.
    """
    return RootModel.load(WEIGHTS / f"{name}.safetensors")[0]
