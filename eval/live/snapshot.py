"""What the service tells its page: the last frame of each user, all in one line of JSON.

Poses are base64 of float32 numbers: as decimal digits they would take the service twenty times as long.
"""

import base64
import json
from collections.abc import Mapping

import numpy as np

from datasets.motion.humanoid import BODY_COUNT
from eval.live.messages import UserView

_ROOT, _ROTATIONS = slice(0, 3), slice(3, 3 + 4 * BODY_COUNT)  # in the row of a user


def write_snapshot(views: Mapping[int, UserView]) -> bytes:
    """Return the line that tells the views of all users, in the order of their numbers."""
    in_order = sorted(views.items())
    rows = [np.concat([view.root, view.rotations.reshape(-1)]) for _, view in in_order]
    poses = np.array(rows, dtype="<f4").tobytes()
    users = [
        {
            "user": user,
            "name": view.name,
            "state": view.state,
            "contacts": view.contacts.tolist(),
            "scale": view.scale,
            "fps": view.fps,
            "latency_ms": view.latency_ms,
        }
        for user, view in in_order
    ]
    return json.dumps({"users": users, "poses": base64.b64encode(poses).decode()}).encode() + b"\n"


def read_snapshot(line: bytes) -> dict[int, UserView]:
    """Return the views of all users by number, in their order, that a line tells."""
    told = json.loads(line)
    rows = np.frombuffer(base64.b64decode(told["poses"]), dtype="<f4").reshape(len(told["users"]), _ROTATIONS.stop)
    return {
        one["user"]: UserView(
            one["name"],
            one["state"],
            row[_ROOT],
            row[_ROTATIONS].reshape(BODY_COUNT, 4),
            np.array(one["contacts"]),
            one["scale"],
            one["fps"],
            one["latency_ms"],
        )
        for one, row in zip(told["users"], rows, strict=True)
    }
