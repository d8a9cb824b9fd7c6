"""Suit study: raw signals, orientations and clips of the simulated suit beside those of real recordings.

The real side: 17 sensors on a person without truth (qmt), one walk with raw signals and Vicon (neura), four clips that
suits exported (Rokoko, Perception Neuron, Xsens twice). The simulated side: the same walk, and optical clips of CMU.
"""

from pathlib import Path
from typing import Any

import numpy as np
from scipy.io import loadmat
from scipy.spatial.transform import Rotation
from vqf import VQF

from configs.errors import InputError
from datasets.imu.sensor_model import CALIBRATION_SAMPLES, CLIP_START_SAMPLE, SENSOR_BODIES, SENSOR_RATE_HZ, SuitNoise, simulate_sensors
from datasets.imu.suit_simulation import sensor_orientations, simulate_suit
from datasets.library.sources import SYNTHETIC_SOURCE, load_clips
from datasets.motion.clip import BodyMotion
from datasets.motion.humanoid import BODY_NAMES, GRAVITY_M_S2
from datasets.motion.kinematics import body_poses, resample
from eval.evaluation_recordings import IMU_SUIT_CLIPS, OPTICAL_WALK_FRAMES, SENSOR_WALK_FOLDER, WALK_SENSORS
from eval.metrics.artefacts import artefact_metrics, mean_distance_local_mm, mean_distance_world_mm, support_slide

COMPARED_MEASURES = ("foot_skate", "support_slide", "floating", "ground_penetration", "self_penetration", "jitter")
MAX_CLIP_S = 15.0  # part of each optical clip, so that long ones do not dominate
NUM_SEEDS = 3

Samples = dict[str, list[float]]
Row = dict[str, Any]
Finding = dict[str, str | bool]


def suit_study(data: Path) -> dict[str, Any]:
    """Return the study's rows and findings.

    Args:
        data: Folder of real motion.

    Raises:
        InputError: If a recording is not there.
    """
    for name in (*IMU_SUIT_CLIPS, SENSOR_WALK_FOLDER, "mit/imu/qmt_full_body_17imu.mat", "cmu/train", "cmu/test"):
        if not (data / name).exists():
            raise InputError(f"{data / name}: no such recording; the study needs it, --data names the folder of real motion")
    rest = [_row("at rest, real", real_rest_noise(data)), _row("at rest, simulated", simulated_rest_noise())]
    walk = [_row("walk, real sensors", real_walk_errors(data)), _row("walk, simulated sensors", simulated_walk_errors(data))]
    clips, findings = _compare_clips(data)
    return {"study": "suit", "rows": rest + walk + clips, "findings": _walk_findings(*walk) + findings}


def real_rest_noise(data: Path) -> Samples:
    """Return noise and bias of 17 real sensors, each in its quietest second."""
    sensors = [s for s in loadmat(data / "mit/imu/qmt_full_body_17imu.mat", simplify_cells=True).values() if isinstance(s, dict)]
    samples: Samples = {}
    for sensor in sensors:
        seconds = len(sensor["gyr"]) // 100
        turns = np.reshape(sensor["gyr"][: 100 * seconds], (seconds, 100, 3))
        quietest = turns.std(axis=1).mean(axis=1).argmin()
        forces = np.reshape(sensor["acc"][: 100 * seconds], (seconds, 100, 3))[quietest]
        _add(samples, _rest(turns[quietest], forces))
    return samples


def simulated_rest_noise() -> Samples:
    """Return noise and bias of simulated sensors on a wearer who stands perfectly still."""
    local = np.tile([1.0, 0.0, 0.0, 0.0], (2, len(BODY_NAMES), 1))
    recording = simulate_sensors(
        BodyMotion(np.tile([0.0, 0.0, 0.94], (2, 1)), local, 60.0, "standing"), SuitNoise(), np.random.default_rng(0)
    )
    second = slice(CALIBRATION_SAMPLES.stop - 100, CALIBRATION_SAMPLES.stop)
    samples: Samples = {}
    for sensor in range(len(SENSOR_BODIES)):
        _add(samples, _rest(recording.angular_velocities[second, sensor], recording.accelerations[second, sensor]))
    return samples


def _rest(turns: np.ndarray, forces: np.ndarray) -> dict[str, float]:
    return {
        "gyroscope_noise": float(turns.std(axis=0).mean()),
        "gyroscope_bias": float(np.linalg.norm(turns.mean(axis=0))),
        "accelerometer_noise": float(forces.std(axis=0).mean()),
        "gravity_error": float(abs(np.linalg.norm(forces.mean(axis=0)) - GRAVITY_M_S2)),
    }


def real_walk_errors(data: Path) -> Samples:
    """Return the error of VQF against Vicon [deg] and the variation of the magnetic norm, of real sensors in a walk."""
    folder = data / SENSOR_WALK_FOLDER
    lines = (folder / "vicon/S02-Trial-Walk-1.csv").read_text().splitlines()[5:]
    names, vicon = lines[0].split(","), np.array([[float(x) for x in line.split(",")] for line in lines[1:]])
    samples: Samples = {}
    for body, (sensor, prefix) in WALK_SENSORS.items():
        raw = np.genfromtxt(folder / f"rawimu/S02-Trial-Walk-1-{sensor}.txt", delimiter=",", skip_header=6)
        forces, turns, fields = (np.ascontiguousarray(raw[:, at : at + 3]) for at in (2, 5, 8))
        found = VQF(1.0 / SENSOR_RATE_HZ).updateBatch(turns, forces, fields)["quat9D"][OPTICAL_WALK_FRAMES]
        first = names.index(f"{prefix}_1")
        _add(samples, _walk(body, found, vicon[:, first : first + 4], fields[OPTICAL_WALK_FRAMES]))
    return samples


def simulated_walk_errors(data: Path) -> Samples:
    """Return the same measures of simulated sensors on the same walk, over several sessions."""
    walk = load_clips(data / IMU_SUIT_CLIPS[-1], fps=SENSOR_RATE_HZ)[0]
    frames = slice(CLIP_START_SAMPLE + OPTICAL_WALK_FRAMES.start, CLIP_START_SAMPLE + OPTICAL_WALK_FRAMES.stop)
    truth = body_poses(resample(walk, SENSOR_RATE_HZ))[1][OPTICAL_WALK_FRAMES]
    samples: Samples = {}
    for seed in range(NUM_SEEDS):
        recording = simulate_sensors(walk, SuitNoise(), np.random.default_rng(seed))
        found = sensor_orientations(recording)[frames]
        for body in WALK_SENSORS:
            sensor = SENSOR_BODIES.index(BODY_NAMES.index(body))
            _add(samples, _walk(body, found[:, sensor], truth[:, BODY_NAMES.index(body)], recording.magnetic_fields[frames, sensor]))
    return samples


def _walk(body: str, found: np.ndarray, truth: np.ndarray, fields: np.ndarray) -> dict[str, float]:
    part = body.split("_")[0]
    residual = residual_angles(found, truth)
    half = len(residual) // 2
    return {
        f"orientation_error_{part}": float(np.sqrt(np.mean(residual**2))),
        f"magnetic_variation_{part}": float(np.linalg.norm(fields, axis=1).std()),
        "orientation_drift": float(abs(residual[half:].mean() - residual[:half].mean())),
    }


def residual_angles(found: np.ndarray, truth: np.ndarray) -> np.ndarray:
    """Return the angles [deg] (T,) that remain when the best constant rotations of sensor and world are removed.

    Args:
        found: Orientations of a sensor, wxyz, shape (T, 4).
        truth: Orientations of its body in another world frame, shape (T, 4).
    """
    sensor, body = Rotation.from_quat(found, scalar_first=True), Rotation.from_quat(truth, scalar_first=True)
    middle = len(found) // 2
    mounting = Rotation.align_vectors((sensor[middle].inv() * sensor).as_rotvec(), (body[middle].inv() * body).as_rotvec())[0]
    world = (body * (sensor * mounting).inv()).mean()
    for _ in range(30):  # each is the best given the other
        mounting = ((world * sensor).inv() * body).mean()
        world = (body * (sensor * mounting).inv()).mean()
    return np.degrees(((world * sensor * mounting).inv() * body).magnitude())


def _compare_clips(data: Path) -> tuple[list[Row], list[Finding]]:
    """Return the rows of clips, and whether the medians of simulated clips lie in the range of real ones."""
    real = {clip.name: _seen(clip) for name in IMU_SUIT_CLIPS for clip in load_clips(data / name)}
    optical = [load_clips(path)[0] for path in sorted((data / "cmu").rglob("*.bvh"))]
    clean, simulated = _with_suit([clip.cut(0, min(len(clip), int(MAX_CLIP_S * clip.fps))) for clip in optical])
    planted, planted_suit = _with_suit(load_clips(SYNTHETIC_SOURCE))
    rows = [_row(f"real suit: {name}", {key: [x] for key, x in values.items()}) for name, values in real.items()]
    sets = {"real suits": list(real.values()), "clean optical (cmu)": clean, "simulated suit (cmu)": simulated}
    sets |= {"clean synthetic": planted, "simulated suit (synthetic)": planted_suit}
    rows += [_row(name, _gather(clips)) for name, clips in sets.items()]
    return rows, [_in_range(key, list(real.values()), simulated) for key in COMPARED_MEASURES]


def _seen(clip: BodyMotion) -> dict[str, float]:
    """Return the artefacts of a clip and the slide of the supporting foot.

    Real clips have no truth, so none is used for the others: a foot is in contact by its own height on both sides. A swinging
    foot that passes under 2 cm is then in contact too and dominates ``foot_skate``; the slower foot's speed needs no contact.
    """
    return artefact_metrics(clip) | {"support_slide": support_slide(clip)}


def _with_suit(clips: list[BodyMotion]) -> tuple[list[dict[str, float]], list[dict[str, float]]]:
    """Return the measures of the clips and of their recordings by simulated suits."""
    clean, simulated = [], []
    for seed, clip in enumerate(clips):
        faulty = simulate_suit(clip, seed).faulty
        clean.append(_seen(clip))
        simulated.append(
            _seen(faulty)
            | {"truth_error_local": mean_distance_local_mm(faulty, clip), "truth_error_world": mean_distance_world_mm(faulty, clip)}
        )
    return clean, simulated


def _in_range(key: str, real: list[dict[str, float]], simulated: list[dict[str, float]]) -> Finding:
    low, high = min(v[key] for v in real), max(v[key] for v in real)
    values = np.array([v[key] for v in simulated])
    median, inside = float(np.median(values)), float(np.mean((values >= low) & (values <= high)))
    text = f"{key}: median {median:.3g} of simulated clips is in the range of real ones, {low:.3g} to {high:.3g}; {inside:.0%} of clips are"
    return {"finding": text, "reproduced": low <= median <= high}


def _walk_findings(real: Row, simulated: Row) -> list[Finding]:
    """Return whether each measure of the simulated walk is within a factor of two of the real one's."""
    findings: list[Finding] = []
    for key in real["ours"]:
        ratio = simulated["ours"][key]["mean"] / real["ours"][key]["mean"]
        text = f"walk, {key}: simulated over real is {ratio:.2f}, within a factor of two"
        findings.append({"finding": text, "reproduced": 0.5 <= ratio <= 2.0})
    return findings


def _add(samples: Samples, values: dict[str, float]) -> None:
    for key, value in values.items():
        samples.setdefault(key, []).append(value)


def _gather(clips: list[dict[str, float]]) -> Samples:
    return {key: [values[key] for values in clips] for key in clips[0]}


def _row(name: str, samples: Samples) -> Row:
    """Return a study's row: mean, standard deviation and number of sensors, sessions or clips."""
    ours = {key: {"mean": float(np.mean(x)), "std": float(np.std(x)), "seeds": len(x)} for key, x in samples.items()}
    return {"name": name, "ours": ours, "published": {}}
