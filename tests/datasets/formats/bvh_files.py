"""A tiny BVH file for tests of its reader, and what they do with it again and again."""

import dataclasses
from pathlib import Path

import numpy as np

from datasets.formats.bvh import Bvh

# Nine channels: the root's six, Arm's position along Y alone and its turns about X and Z, none for Hand.
TINY = """HIERARCHY
ROOT Hips
{
	OFFSET 0.5 0 0
	CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
	JOINT Arm
	{
		OFFSET 10 0 0
		CHANNELS 3 Yposition Xrotation Zrotation
		JOINT Hand
		{
			OFFSET 0 4 0
			CHANNELS 0
			End Site
			{
				OFFSET 0 -7.5 1e-05
			}
			End Site
			{
				OFFSET 0 1 0
			}
		}
	}
}
MOTION
Frames: 2
Frame Time: 0.0083333
1 2 3 90 0 0 0 0 0
1 2 3 0 0 0 3 90 450.25
"""


def write(folder: Path, text: str | bytes) -> Path:
    """Write a file into a folder; return it."""
    path = folder / "clip.bvh"
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    return path


def assert_equal(one: Bvh, other: Bvh, *ignored: str) -> None:
    """Check that two clips are equal in every number and name, and in everything else but the fields ``ignored``."""
    for field in dataclasses.fields(Bvh):
        if field.name not in ignored:
            np.testing.assert_equal(getattr(one, field.name), getattr(other, field.name))  # exact, arrays and tuples alike
