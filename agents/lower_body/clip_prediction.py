"""Lower bodies of whole clips, the network's state carried from their first frame on, as live."""

from collections.abc import Sequence

import numpy as np
import torch

from agents.lower_body.agreed_contacts import agreed_contacts
from agents.lower_body.model import LowerBodyModel, LowerBodyPrediction
from agents.lower_body.pose import LowerBodyPose, lower_body_pose, tracking_masks
from agents.lower_body.tracked_contacts import TrackedContacts
from agents.lower_body.tracked_legs import reach_tracked_joints
from datasets.trackers.joint_features import JointPoses, joint_features
from datasets.trackers.trackers import FOOT_TRACKERS

BATCH_CLIPS = 32


@torch.inference_mode()
def predict_clips(model: LowerBodyModel, clips: Sequence[JointPoses]) -> list[LowerBodyPose]:
    """Return the lower bodies in all frames of clips, legs at the joints that are tracked; clips of similar length share a batch.

    Args:
        model: Trained network.
        clips: Poses of the joints as seen, NumPy, shape (T, 8, ...) each.
    """
    order = sorted(range(len(clips)), key=lambda clip: len(clips[clip].positions))
    found: dict[int, LowerBodyPose] = {}
    for first in range(0, len(order), BATCH_CLIPS):
        some = order[first : first + BATCH_CLIPS]
        features = torch.nn.utils.rnn.pad_sequence([_features(clips[clip]) for clip in some], batch_first=True)
        masks = torch.nn.utils.rnn.pad_sequence([torch.from_numpy(tracking_masks(clips[clip])) for clip in some], batch_first=True)
        predicted = model.eval()(features, masks)
        for row, clip in enumerate(some):
            frames = len(clips[clip].positions)
            own = LowerBodyPrediction(*(part[row, :frames] for part in predicted))
            body = lower_body_pose(clips[clip], own)
            toes = body.toes
            before = np.concat([np.full_like(toes[:1], np.nan), toes[:-1]])
            contacts = _contacts(clips[clip], agreed_contacts(own.contacts.numpy(), toes, before))
            found[clip] = reach_tracked_joints(body._replace(contacts=contacts), clips[clip])
    return [found[clip] for clip in range(len(clips))]


def _contacts(joints: JointPoses, contacts: np.ndarray) -> np.ndarray:
    """Return the contacts (T, 2) of a clip, those of feet that are tracked by their height."""
    if not joints.seen[:, FOOT_TRACKERS].any():
        return contacts
    tracked, row = TrackedContacts(1), np.zeros(1, dtype=int)
    frames = [JointPoses(*(part[frame : frame + 1] for part in joints)) for frame in range(len(contacts))]
    return np.concat([tracked.step(row, frame, contacts[number : number + 1]) for number, frame in enumerate(frames)])


def _features(joints: JointPoses) -> torch.Tensor:
    before = JointPoses(*(np.concat([part[:1], part[:-1]]) for part in joints))
    before.seen[0] = before.oriented[0] = False
    return torch.from_numpy(joint_features(before, joints).astype(np.float32))
