"""The trained models in the package; ``agents/weights/README.md`` says what each was trained on."""

from functools import cache

from agents.root.model import RootModel
from configs.source_code import PROJECT_ROOT

WEIGHTS_FOLDER = PROJECT_ROOT / "agents" / "weights"
PRETRAINED_POLICY = WEIGHTS_FOLDER / "mimic.safetensors"
PRETRAINED_LOBSTR = WEIGHTS_FOLDER / "lobstr.safetensors"


@cache
def load_pretrained_root(name: str) -> RootModel:
    """Return a trained root model of the package.

    Args:
        name: "root3d", "root3d_pose" or "planar".

    Raises:
        InputError: If the package holds no such model.
    """
    return RootModel.load(WEIGHTS_FOLDER / f"{name}.safetensors")[0]
