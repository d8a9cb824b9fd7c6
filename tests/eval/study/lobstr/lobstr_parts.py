"""Clips, users and networks for the tests of the LoBSTr study."""

from dataclasses import replace

import numpy as np
import torch

from agents.lobstr.encoders import RecurrentEncoder
from agents.lobstr.model import LobstrModel
from agents.lobstr.spec import LobstrSpec
from datasets.motion.kinematics import resample
from datasets.trackers.calibration import identity_calibration
from eval.study.lobstr.evaluation_sessions import EvaluationClip, Session
from tests.builders import lively


def clip(name: str = "cmu_1", kind: str = "walk", seed: int = 0, system: str = "optical") -> EvaluationClip:
    """Return a lively clip of two seconds at 45 Hz."""
    return EvaluationClip(replace(resample(lively(seed), 45.0), name=name, kind=kind, system=system))


def session(of: EvaluationClip, size: float = 1.0, calibrated: float = 1.0, height: int = 171) -> Session:
    """Return a clip by somebody ``size`` times as tall as the humanoid, who is taken to be ``calibrated`` times."""
    one = identity_calibration(1).rows(np.array(0))._replace(scale=np.array(calibrated))
    return Session(of, height, size, one, of.joints._replace(positions=size * of.joints.positions), (0,))


def network(encoder: str = "gru", autoregressive: bool = False) -> LobstrModel:
    """Return a small network with random weights; one that is recurrent remembers for long."""
    torch.manual_seed(0)
    model = LobstrModel(LobstrSpec(encoder=encoder, hidden=12, latent=48, autoregressive=autoregressive)).eval()
    if isinstance(model.encoder, RecurrentEncoder):
        with torch.no_grad():
            model.encoder.layer.bias_hh_l0[12:24] += 3.0  # of the update gate, which then keeps 95 %
    return model
