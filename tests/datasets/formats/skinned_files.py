"""A tube on two bones as GLB, written by hand, and linear blend skinning as its definition has it."""

import json
from pathlib import Path
from typing import Any

import numpy as np

from datasets.formats.skinned_mesh import SkinnedMesh
from datasets.motion.rotation import rotate

FPS, KEYS = 30.0, 12
RING = np.array([(0.2, 0.0, 0.0), (0.0, 0.0, -0.2), (-0.2, 0.0, 0.0), (0.0, 0.0, 0.2)])  # Y up, seen from above against the clock
HEIGHTS = (1.0, 2.0, 3.0)  # of the tube's rings; bones begin at 1 and 2
WEIGHTS = ((1.0, 0.0), (0.5, 0.5), (0.0, 1.0))  # of the two bones on each ring
BENT = (np.sin(np.pi / 4), 0.0, 0.0, np.cos(np.pi / 4))  # xyzw, 90 degrees about x
ELSEWHERE = (0.0, 0.0, np.sin(0.3), np.cos(0.3))  # rotation of the node in which the tube is neither bound nor animated


def skin(mesh: SkinnedMesh, positions: np.ndarray, rotations: np.ndarray) -> np.ndarray:
    """Return the vertices (V, 3) by the places (J, 3) of the joints and their rotations against the rest pose (J, 4)."""
    moved = np.zeros(mesh.vertices.shape)
    for slot in range(mesh.joints.shape[1]):
        joints = mesh.joints[:, slot]
        moved += mesh.weights[:, slot, None] * (rotate(rotations[joints], mesh.vertices - mesh.rest_positions[joints]) + positions[joints])
    return moved


def write_tube(path: Path, weights: Any = WEIGHTS) -> None:
    """Write a tube whose upper bone bends by 90 degrees about x in the middle of its animation; of glTF's Y up, in metres."""
    points = np.concat([RING + np.array([0.0, height, 0.0]) for height in HEIGHTS])
    faces = [
        (4 * ring + a, 4 * ring + b, 4 * ring + 4 + c)
        for ring in range(2)
        for at in range(4)
        for a, b, c in ((at, (at + 1) % 4, at), ((at + 1) % 4, (at + 1) % 4 + 4, at))
    ]
    binds = np.tile(np.eye(4), (2, 1, 1))
    binds[:, 1, 3] = -1.0, -2.0
    turns = np.tile((0.0, 0.0, 0.0, 1.0), (KEYS, 1))
    turns[KEYS // 2 :] = BENT
    tables = [
        (np.array(points, "<f4"), "VEC3", 5126, {"min": points.min(axis=0).tolist(), "max": points.max(axis=0).tolist()}),
        (np.array(faces, "<u2").ravel(), "SCALAR", 5123, {}),
        (np.tile(np.array((0, 1, 0, 0), "u1"), (len(points), 1)), "VEC4", 5121, {}),
        (np.pad(np.repeat(np.array(weights, "<f4"), 4, axis=0), ((0, 0), (0, 2))), "VEC4", 5126, {}),
        (np.array(binds.swapaxes(1, 2), "<f4"), "MAT4", 5126, {}),
        (np.array(np.arange(KEYS) / FPS, "<f4"), "SCALAR", 5126, {"min": [0.0], "max": [(KEYS - 1) / FPS]}),
        (np.array(turns, "<f4"), "VEC4", 5126, {}),
    ]
    data, views, accessors = b"", [], []
    for number, (table, kind, component, limits) in enumerate(tables):
        views.append({"buffer": 0, "byteOffset": len(data), "byteLength": table.nbytes})
        accessors.append({"bufferView": number, "componentType": component, "count": len(table), "type": kind, **limits})
        data += table.tobytes() + bytes(-table.nbytes % 4)
    scene = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0, 2]}],
        "nodes": [
            {"name": "Low", "translation": [0.0, 1.0, 0.0], "children": [1]},
            {"name": "High", "translation": [0.0, 1.0, 0.0], "rotation": ELSEWHERE},
            {"name": "Tube", "mesh": 0, "skin": 0},
        ],
        "skins": [{"joints": [0, 1], "inverseBindMatrices": 4, "skeleton": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "JOINTS_0": 2, "WEIGHTS_0": 3}, "indices": 1}]}],
        "animations": [
            {
                "samplers": [{"input": 5, "output": 6, "interpolation": "LINEAR"}],
                "channels": [{"sampler": 0, "target": {"node": 1, "path": "rotation"}}],
            }
        ],
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{"byteLength": len(data)}],
    }
    text = json.dumps(scene).encode()
    text += b" " * (-len(text) % 4)
    chunks = b"".join(len(chunk).to_bytes(4, "little") + kind + chunk for kind, chunk in ((b"JSON", text), (b"BIN\0", data)))
    path.write_bytes(b"glTF" + (2).to_bytes(4, "little") + (12 + len(chunks)).to_bytes(4, "little") + chunks)
