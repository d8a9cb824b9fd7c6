"""Takes the place of ``adapt-mimic`` in tests of the add-on: lifts the figure, turns a joint, and says so in the command's JSON lines.

``STAND_IN_KEEPS`` is a folder for copies of what was read and written; ``STAND_IN_FAILS`` is the line that it ends with instead.
"""

import json
import os
import shutil
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from datasets.formats.bvh import channel_values, local_pose, read_bvh, write_bvh
from datasets.motion.rotation import from_axis_angle, multiply

LIFT, TURNED, TURN_RAD = 0.25, "LeftArm", 0.6
EVENTS = (
    {"event": "notice", "text": "The left knee was moved.", "start_s": 0.1, "stop_s": 0.2},
    {"event": "notice", "text": "Read with care.", "start_s": None, "stop_s": None},
    {
        "event": "result", "read_as": "Taken for a figure.", "seconds": 0.5, "took_s": 1.0, "physics_share": 0.5, "restarts_s": [0.2],
        "contacts": {"left": [[0.0, 0.1]], "right": [[0.2, 0.3], [0.4, 0.5]]},
    },
)  # fmt: skip


def main() -> int:
    """Clean, or fail."""
    source, out = Path(sys.argv[2]), Path(sys.argv[4])
    say({"event": "stage", "stage": "simulating", "share": 0.5, "overall": 0.5, "seconds_left": 1.0})
    if os.environ.get("STAND_IN_WAITS"):
        time.sleep(60.0)
    if os.environ.get("STAND_IN_FAILS"):
        say({"event": "error", "text": os.environ["STAND_IN_FAILS"].format(source)})
        if "name them" in os.environ["STAND_IN_FAILS"]:
            Path("motion.mapping.yaml").write_text("pelvis: bone\n")
        return 2
    bvh = read_bvh(source)
    positions, rotations = (table.copy() for table in local_pose(bvh))
    positions[:, 0, 2] += LIFT
    joint = bvh.names.index(TURNED)
    rotations[:, joint] = multiply(
        rotations[:, joint], np.broadcast_to(from_axis_angle(np.eye(3)[0], np.array(TURN_RAD)), (len(rotations), 4))
    )
    values, columns = bvh.values.copy(), np.repeat(np.arange(len(bvh.names)), [len(channels) for channels in bvh.channels])
    changed = np.isin(columns, (0, joint))
    values[:, changed] = channel_values(bvh, positions, rotations)[:, changed]
    write_bvh(out, replace(bvh, values=values))
    for event in EVENTS:
        say(event)
    if os.environ.get("STAND_IN_KEEPS"):
        shutil.copy(source, Path(os.environ["STAND_IN_KEEPS"]) / "in.bvh")
        shutil.copy(out, Path(os.environ["STAND_IN_KEEPS"]) / "out.bvh")
        (Path(os.environ["STAND_IN_KEEPS"]) / "words.json").write_text(json.dumps(sys.argv[1:]))
    return 0


def say(event: dict) -> None:
    """Print an event."""
    print(json.dumps(event), flush=True)


if __name__ == "__main__":
    sys.exit(main())
