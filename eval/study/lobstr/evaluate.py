"""Evaluation of LoBSTr's networks, and of baselines without training, on test clips and the sessions of virtual users."""

from collections.abc import Sequence

import numpy as np
import torch

from agents.lobstr.model import LobstrModel, LowerBodyPrediction, leg_matrices, pose_targets
from agents.lobstr.spec import RECURRENT, WINDOW_FRAMES, LobstrSpec
from datasets.motion.rotation import to_matrix
from datasets.motion.rotation_matrices import matrices_to_quaternions
from datasets.trackers.features import tracker_features
from datasets.trackers.lower_body import to_rotation_6d
from datasets.trackers.trackers import PELVIS_TRACKER, TRACKER_RATE_HZ, TrackerPoses
from eval.study.lobstr.evaluation_sessions import EvaluationClip, Session
from eval.study.lobstr.scores import PredictedLegs, Scores, score_clips
from eval.study.lobstr.six_point_baseline import find_foot_strikes, foot_poses, occlude_feet, solve_legs_ik
from trainers.supervised.lobstr_data import LobstrData

BATCH_SIZES = 512, 64  # windows of a batch; clips of a batch where the state is carried
FREE_RUN_FRAMES = round(600.0 * TRACKER_RATE_HZ)  # length of the autoregressive network's free run
EXPLOSION_THRESHOLD = 2.0  # magnitude of any component of a pose; those of true poses are at most 1
MAX_FEEDBACK = 1e6  # magnitude at which fed-back components are clipped


def evaluate_model(model: LobstrModel, clips: Sequence[EvaluationClip]) -> Scores:
    """Return all measures with perfect trackers: in windows of a second, as the paper has it, and with the state carried through clips."""
    joints = [clip.joints for clip in clips]
    if model.spec.autoregressive:
        return _evaluate_autoregressive(model, clips, joints)
    found = score_clips(clips, predict(model, joints, carried=False))
    if model.spec.encoder in RECURRENT:
        found |= {f"{name}_carried": value for name, value in score_clips(clips, predict(model, joints, carried=True)).items()}
    return found


@torch.inference_mode()
def predict(model: LobstrModel, joints: Sequence[TrackerPoses], carried: bool) -> list[PredictedLegs]:
    """Return the prediction of a network without feedback of its own poses for each clip.

    Args:
        model: Trained model.
        joints: Tracker poses of each clip from its first frame on, (T, 4, ...).
        carried: Whether a recurrent network's state is carried from frame to frame, as live, rather than begun anew for each window.
    """
    return [_posed(model.spec, model.decode(states), one) for states, one in zip(_states(model, joints, carried), joints, strict=True)]


def simulate_six_point(sessions: Sequence[Session], lost: bool) -> tuple[list[PredictedLegs], list[np.ndarray]]:
    """Return the legs of six-point tracking in each session, and whether each foot is hidden, both from frame 45 on.

    Args:
        sessions: Sessions; the places of the trackers are compensated as well.
        lost: Whether the feet's trackers are shaken off and hidden now and then.
    """
    legs, hidden = [], []
    for session in sessions:
        feet = foot_poses(session.clip.motion)
        scaled = feet._replace(positions=session.size_ratio * feet.positions)
        strikes = np.concat([np.zeros((WINDOW_FRAMES, 2), dtype=bool), find_foot_strikes(session.clip.contacts)])
        seen, mask = occlude_feet(scaled, strikes, np.random.default_rng(session.seed))
        tracked = seen if lost else scaled
        tracked = tracked._replace(positions=tracked.positions / session.calibration.scale)
        legs.append(PredictedLegs(solve_legs_ik(session.joints(compensate_positions=True), tracked)[WINDOW_FRAMES:]))
        hidden.append(mask[WINDOW_FRAMES:])
    return legs, hidden


def predict_mean_pose(motion: LobstrData, clips: Sequence[EvaluationClip]) -> list[PredictedLegs]:
    """Return the pose nearest to the mean of training clips, throughout the test clips."""
    pose = _of_training(motion, motion.frames.poses).double().mean(0, keepdim=True)
    legs = matrices_to_quaternions(leg_matrices(LobstrSpec(), pose.numpy(), np.array([[1.0, 0.0, 0.0, 0.0]])))
    return [PredictedLegs(np.repeat(legs, len(clip.legs), axis=0)) for clip in clips]


def score_majority_class(motion: LobstrData, clips: Sequence[EvaluationClip]) -> Scores:
    """Return the contact accuracy of always predicting the class that is commoner in the training clips [%]."""
    commoner = bool(_of_training(motion, motion.frames.contacts).mean() > 0.5)
    predicted = [PredictedLegs(clip.legs, np.full(clip.contacts.shape, commoner)) for clip in clips]
    return {name: value for name, value in score_clips(clips, predicted).items() if name.startswith("contact_accuracy")}


def _of_training(motion: LobstrData, frames: torch.Tensor) -> torch.Tensor:
    return torch.cat([frames[clip.start : clip.start + clip.frames] for clip in motion.training.clips])


def _evaluate_autoregressive(model: LobstrModel, clips: Sequence[EvaluationClip], joints: Sequence[TrackerPoses]) -> Scores:
    """Return the measures of an autoregressive network running freely, those with the true pose fed back, and whether it explodes."""
    states = _states(model, joints, carried=False)
    true = [_true_poses(model.spec, clip) for clip in clips]
    after = [EvaluationClip(clip.motion.cut(1, len(clip.motion))) for clip in clips]
    free = [
        _posed(model.spec, _run_autoregressively(model, own[1:], poses[0]), clip.joints)
        for own, poses, clip in zip(states, true, after, strict=True)
    ]
    with torch.inference_mode():
        bodies = [model.decode(own[1:], poses[:-1]) for own, poses in zip(states, true, strict=True)]
    with_truth = [_posed(model.spec, body, clip.joints) for body, clip in zip(bodies, after, strict=True)]
    found = score_clips(after, free)
    found |= {f"{name}_told": value for name, value in score_clips(after, with_truth).items()}
    endless = torch.cat(states).repeat(-(-FREE_RUN_FRAMES // sum(map(len, states))), 1)[:FREE_RUN_FRAMES]
    sizes = _run_autoregressively(model, endless, true[0][0]).pose.abs().amax(1)
    exploded = torch.nonzero(sizes > EXPLOSION_THRESHOLD).flatten()
    return found | {
        "frames_until_explosion": float(exploded[0] if len(exploded) else FREE_RUN_FRAMES),
        "exploded": float(len(exploded) > 0),
    }


@torch.inference_mode()
def _run_autoregressively(model: LobstrModel, states: torch.Tensor, pose: torch.Tensor) -> LowerBodyPrediction:
    """Return predictions for encoder states (S, hidden) one after the other, each with the previous prediction fed back, first ``pose``."""
    predicted = []
    for state in states:
        body = model.decode(state, pose)
        pose = body.pose.clamp(-MAX_FEEDBACK, MAX_FEEDBACK)
        predicted.append((pose, body.contact))
    return LowerBodyPrediction(*(torch.stack(part) for part in zip(*predicted, strict=True)))


@torch.inference_mode()
def _states(model: LobstrModel, joints: Sequence[TrackerPoses], carried: bool) -> list[torch.Tensor]:
    """Return the encoder's states (S, hidden) in all frames of each clip that have a second behind them."""
    model.eval()
    features = [model.normalise(_features(model.spec.inputs, one)) for one in joints]
    if carried or model.spec.encoder not in RECURRENT:
        return _through_clips(model, features)
    windows = torch.cat([one.unfold(0, WINDOW_FRAMES, 1).transpose(1, 2) for one in features])
    states = torch.cat([model.encoder(some)[:, 0] for some in windows.split(BATCH_SIZES[0])])
    return list(states.split([len(one) - WINDOW_FRAMES + 1 for one in features]))


def _through_clips(model: LobstrModel, features: Sequence[torch.Tensor]) -> list[torch.Tensor]:
    """Return the states of an encoder that is begun once per clip; clips of similar length share a batch."""
    found: dict[int, torch.Tensor] = {}
    order = sorted(range(len(features)), key=lambda clip: len(features[clip]))
    for first in range(0, len(order), BATCH_SIZES[1]):
        some = order[first : first + BATCH_SIZES[1]]
        padded = torch.nn.utils.rnn.pad_sequence([features[clip] for clip in some], batch_first=True)
        for clip, states in zip(some, model.encoder(padded), strict=True):
            found[clip] = states[: len(features[clip]) - WINDOW_FRAMES + 1].clone()
    return [found[clip] for clip in range(len(features))]


def _features(kind: str, joints: TrackerPoses) -> torch.Tensor:
    """Return the input features (T - 1, F) of a clip from its second frame on."""
    before, now = TrackerPoses(*(part[:-1] for part in joints)), TrackerPoses(*(part[1:] for part in joints))
    return torch.from_numpy(tracker_features(kind, before, now).astype(np.float32))


def _true_poses(spec: LobstrSpec, clip: EvaluationClip) -> torch.Tensor:
    """Return the target poses (S, 48) of a clip."""
    poses = to_rotation_6d(to_matrix(clip.legs)).reshape(len(clip.legs), -1)
    return torch.from_numpy(pose_targets(spec, poses, clip.joints.rotations[WINDOW_FRAMES:, PELVIS_TRACKER]).astype(np.float32))


def _posed(spec: LobstrSpec, body: LowerBodyPrediction, joints: TrackerPoses) -> PredictedLegs:
    """Return the predicted legs of a clip; ``joints`` also hold the frames before the first prediction."""
    legs = leg_matrices(spec, body.pose.double().numpy(), joints.rotations[WINDOW_FRAMES:, PELVIS_TRACKER])
    return PredictedLegs(matrices_to_quaternions(legs), body.contact.numpy().argmax(-1).astype(bool))
