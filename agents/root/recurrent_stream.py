"""The recurrent root model frame by frame: what ``agents.root.recurrent_path`` gives of a whole clip, without PyTorch."""

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from agents.root.model import RootModel
from agents.root.networks.gru import HIDDEN, GruNetwork
from agents.root.recurrent.patches import PATCH_FRAMES, WINDOW_FRAMES, patch_features
from agents.root.recurrent.velocity_filter import patch_displacements, patch_steps
from agents.root.recurrent_path import patch_motion
from datasets.imu.root_features import STANCE_BODIES, RootFrames

Predictor = Callable[[np.ndarray], np.ndarray]


@dataclass(frozen=True)
class StreamFrame:
    """Frame of a stream, in the world's axes.

    Attributes:
        joints: Joints relative to the pelvis [m], shape (20, 3).
        accelerations: Free accelerations of the sensors [m/s^2], shape (19, 3); zero without sensors.
        heading: Heading of the pelvis [rad].
        centre: Centre of mass relative to the pelvis [m], shape (3,).
    """

    joints: np.ndarray
    accelerations: np.ndarray
    heading: np.ndarray
    centre: np.ndarray


class RecurrentRootSteps:
    """Steps of the pelvis of one performance, known as soon as the patch that they belong to has all that it sees."""

    def __init__(self, model: RootModel) -> None:
        """Prepare for the first frame; the model's current weights are copied."""
        self._accelerations = model.spec.accelerations
        self._predict = make_patch_predictor(model)
        self._frames: deque[StreamFrame] = deque(maxlen=WINDOW_FRAMES)
        self._until_patch = WINDOW_FRAMES  # frames that are missing for the next one
        self._outputs = np.zeros((1, 0))
        self._velocity: np.ndarray | None = None

    def push(self, frame: StreamFrame) -> np.ndarray:
        """Return the steps that become known with the next frame [m], shape (4, 3) or (0, 3)."""
        self._frames.append(frame)
        self._until_patch -= 1
        if self._until_patch:
            return np.zeros((0, 3))
        self._until_patch = PATCH_FRAMES
        seen = self._seen()
        felt = seen.accelerations[None] if self._accelerations else None
        self._outputs = self._predict(patch_features(seen.joints[None], seen.heading[:1], felt)[0])[None].astype(float)
        return self._patch(seen, 0)

    def rest(self) -> np.ndarray:
        """Return the steps from where ``push`` has left off to the last frame [m], shape (6, 3) at most."""
        seen, first = self._seen(), self._until_patch
        steps = [self._patch(seen, at) for at in range(first, len(self._frames) - 1, PATCH_FRAMES)]
        return np.concat([np.zeros((0, 3)), *steps])[: len(self._frames) - 1 - first]

    def _seen(self) -> RootFrames:
        """Return the last frames, without the true paths."""
        parts = [np.stack([getattr(frame, name) for frame in self._frames]) for name in ("joints", "accelerations", "heading", "centre")]
        joints, accelerations, heading, centre = parts
        return RootFrames(joints, joints[:, STANCE_BODIES], accelerations, heading, centre, root=centre, com=centre)

    def _patch(self, seen: RootFrames, first: int) -> np.ndarray:
        """Return the steps (4, 3) of the patch that begins ``first`` frames after the oldest, by the newest outputs."""
        steps = patch_steps(self._outputs, patch_motion(seen, np.array([first]), self._accelerations))
        velocity = steps.by_feet if self._velocity is None else self._velocity
        self._velocity = steps.keep * velocity + steps.gained
        return np.diff(patch_displacements(steps, velocity)[0], axis=0, prepend=0.0)


def make_patch_predictor(model: RootModel) -> Predictor:
    """Return a function from the raw features of a patch (F,) to the outputs of the network, which remembers the patches before it.

    Args:
        model: Recurrent root model, whose current weights are copied.
    """
    network = model.network
    assert isinstance(network, GruNetwork)
    weights = {name: value.detach().cpu().numpy().copy() for name, value in model.state_dict().items()}
    first, second, head = ((weights[f"network.{name}.weight"], weights[f"network.{name}.bias"]) for name in ("first", "second", "head"))
    into, back = ((weights[f"network.gru.weight_{kind}_l0"], weights[f"network.gru.bias_{kind}_l0"]) for kind in ("ih", "hh"))
    mean, std = weights["feature_mean"], weights["feature_std"]
    remembered = np.zeros(HIDDEN, dtype=np.float32)

    def predict(features: np.ndarray) -> np.ndarray:
        nonlocal remembered
        x = (features - mean) / std
        for matrix, offset in (first, second):
            x = np.maximum(matrix @ x + offset, 0.0)
        coming, staying = into[0] @ x + into[1], back[0] @ remembered + back[1]
        reset, update = np.split(1.0 / (1.0 + np.exp(-(coming + staying)[: 2 * HIDDEN])), 2)
        new = np.tanh(coming[2 * HIDDEN :] + reset * staying[2 * HIDDEN :])
        remembered = new + update * (remembered - new)
        return head[0] @ remembered + head[1]

    return predict
