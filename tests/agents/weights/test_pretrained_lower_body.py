"""The lower-body network in the package, on made-up people whom no training saw (their seeds are from 900 on) and with perfect trackers.

The limits are the paper's own results on its own data (Table 1): 6.63 cm and 85.77 %.
"""

import json

import numpy as np
import pytest
from safetensors import safe_open

from agents.lower_body.model import LowerBodyModel
from agents.lower_body.stream import LowerBodyStream
from agents.weights.pretrained import PRETRAINED_LOWER_BODY
from datasets.motion.kinematics import resample
from datasets.motion.rotation import to_matrix
from datasets.synthetic.clips import FPS, stand, turn_on_the_spot, walk
from datasets.synthetic.movement_style import draw_movement_style
from datasets.trackers.lower_body import leg_rotations, toe_contacts, toe_positions
from datasets.trackers.trackers import TRACKER_RATE_HZ, TrackerPoses, tracker_poses

SECONDS = 8.0


@pytest.mark.parametrize("movement", ["stand", "turn", "walk"])
def test_toes_are_found(movement: str) -> None:
    rng = np.random.default_rng(900)
    style, t = draw_movement_style("tester", rng), np.arange(round(SECONDS * FPS)) / FPS
    made = {
        "stand": lambda: stand(t, style, rng),
        "turn": lambda: turn_on_the_spot(t, style, rng),
        "walk": lambda: walk(t, 1.2, style, rng),
    }
    clip = resample(made[movement](), TRACKER_RATE_HZ)
    joints = tracker_poses(clip)
    stream, legs, contacts = LowerBodyStream(LowerBodyModel.load(PRETRAINED_LOWER_BODY)[0], 1), [], []
    for positions, rotations in zip(*joints, strict=True):
        body, warm = stream.push(np.array([0]), TrackerPoses(positions[None], rotations[None]))
        if warm[0]:
            legs.append(body.legs[0])
            contacts.append(body.contacts[0])
    true = leg_rotations(clip.local_rotations)[-len(legs) :]
    errors = np.linalg.norm(toe_positions(to_matrix(np.array(legs))) - toe_positions(to_matrix(true)), axis=-1)
    assert len(legs) > (SECONDS - 1.1) * TRACKER_RATE_HZ
    assert errors.mean() < 0.0663
    assert np.mean(np.array(contacts) == toe_contacts(clip)[-len(legs) :]) > 0.8577


def test_it_says_what_it_was_trained_on() -> None:
    with safe_open(PRETRAINED_LOWER_BODY, framework="pt") as file:
        card = json.loads(file.metadata()["card"])
    assert card["data"]["motions"] == "cmu/train"
    assert all(clip.startswith(("cmu_", "synthetic_")) for clip in card["clips"])
