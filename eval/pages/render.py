"""Videos and pictures of the humanoid: the reference beside, or as a ghost behind, the agent that performs it.

Humanoids are posed by generalised positions (50,): root position and rotation, then the 43 hinges, as ``MotionLibrary.start_pose``.
"""

import importlib
import os
import subprocess
import sys
from collections.abc import Iterable, Iterator
from functools import cache
from itertools import chain
from pathlib import Path
from tempfile import TemporaryDirectory
from types import TracebackType
from typing import NamedTuple, Self

import imageio_ffmpeg
import mediapy
import mujoco
import numpy as np
from mujoco.rendering.classic import gl_context
from scipy.ndimage import gaussian_filter1d

from datasets.motion.rotation import heading
from envs.physics.humanoid_mjcf import build_spec

VIDEO_FPS = 30
INSTALL_HINT = "no video: off-screen rendering needs EGL or OSMesa (Debian, Ubuntu: apt install libegl1 libgl1, or libosmesa6)"
REFERENCE_COLOUR = (0.50, 0.54, 0.61, 1.0)
AGENT_COLOUR = (0.16, 0.47, 0.75, 1.0)
LOST_COLOUR = (0.80, 0.36, 0.22, 1.0)
GHOST_ALPHA = 0.40
_VIEW_AZIMUTH_RAD = np.radians(145.0)  # of the camera's direction from the humanoid's heading: a view from its front left
_ELEVATION_DEG = -9.0  # MuJoCo's unit
_HORIZON_COLOUR = [0.93, 0.95, 0.97]
_LIGHT_DISTANCE_M = 4.0  # from the camera's target
# Narrow fields of view, so that humanoids that stand beside each other are seen from the same side.
_VIDEO_HEIGHT_M, _VIDEO_FIELD_DEG = 2.8, 18.0
_STRIP_HEIGHT_M, _STRIP_FIELD_DEG = 2.25, 12.0
_CAMERA_SMOOTHING_S = 0.5  # standard deviation of the smoothing of the reference's path, which the camera follows
_CAMERA_TARGET_HEIGHT_M = 0.85  # of the point that the camera looks at
_COARSE_FACETS = 12, 8  # around and along a rounded shape; of a few pixels each in a video, whose time they take most of
_ENCODER_OPTIONS = "-preset veryfast"  # of FFmpeg: a tenth larger, in a fraction of the time
_PROBE = """
import mujoco
model = mujoco.MjModel.from_xml_string('<mujoco><worldbody><light pos="0 0 3"/><geom size="1"/></worldbody></mujoco>')
data = mujoco.MjData(model)
mujoco.mj_forward(model, data)
with mujoco.Renderer(model, 32, 32) as renderer:
    renderer.update_scene(data)
    raise SystemExit(0 if renderer.render().any() else 1)
"""


class PosedHumanoid(NamedTuple):
    """One humanoid in a picture.

    Attributes:
        pose: Generalised positions, shape (50,).
        colour: Red, green, blue and opacity, each from 0 to 1.
        offset: Offset added to its position in the world [m], shape (3,).
    """

    pose: np.ndarray
    colour: tuple[float, float, float, float]
    offset: np.ndarray


class Camera(NamedTuple):
    """Camera of a picture.

    Attributes:
        target: Point that it looks at [m], shape (3,).
        distance: Distance from the target [m].
        azimuth: Azimuth of its direction [rad].
    """

    target: np.ndarray
    distance: float
    azimuth: float

    @property
    def right(self) -> np.ndarray:
        """Return the horizontal unit vector to the picture's right, shape (3,)."""
        return np.array([np.sin(self.azimuth), -np.cos(self.azimuth), 0.0])

    @property
    def light(self) -> np.ndarray:
        """Return the direction of the light, shape (3,): from behind the camera, steeply down."""
        ahead = np.array([np.cos(self.azimuth), np.sin(self.azimuth), 0.0])
        direction = 0.5 * ahead + 0.25 * self.right - np.array([0.0, 0.0, 1.0])
        return direction / np.linalg.norm(direction)


@cache
def can_render() -> bool:
    """Return whether MuJoCo can render here, and choose how: through EGL, OSMesa or a screen.

    A choice by the environment variable MUJOCO_GL is kept. Each backend is tried in a process of its own, as a failed one cannot be
    unloaded.
    """
    chosen = os.environ.get("MUJOCO_GL")
    if chosen or not sys.platform.startswith("linux"):
        return _backend_works(chosen)
    for backend in ("egl", "osmesa", *(["glfw"] if os.environ.get("DISPLAY") else [])):
        if _backend_works(backend):
            os.environ["MUJOCO_GL"] = backend
            importlib.reload(gl_context)  # it read the variable when it was first imported
            return True
    return False


def _backend_works(backend: str | None) -> bool:
    """Return whether a backend of MuJoCo's renderer works, tried in another process."""
    environment = {**os.environ, **({"MUJOCO_GL": backend} if backend else {})}
    try:
        return subprocess.run([sys.executable, "-c", _PROBE], env=environment, capture_output=True, timeout=60).returncode == 0
    except subprocess.TimeoutExpired:
        return False


class SceneRenderer:
    """Renderer of humanoids on the lit ground. Use as a context, so that its buffers are freed.

    Raises:
        RuntimeError: If ``can_render`` is False.
    """

    def __init__(self, width: int, height: int, field_of_view: float, shadow_radius: float = 4.0, fine: bool = False) -> None:
        """Set up the ground, the light and the buffers.

        Args:
            width: Width of the pictures [pixels].
            height: Height of the pictures [pixels].
            field_of_view: Vertical field of view [deg].
            shadow_radius: Distance from the camera's target within which shadows are drawn [m].
            fine: Whether edges, shadows and shapes are smooth, which takes several times as long.
        """
        if not can_render():
            raise RuntimeError(INSTALL_HINT)
        spec = build_spec()
        spec.visual.global_.offwidth, spec.visual.global_.offheight = width, height
        spec.visual.global_.fovy = field_of_view
        spec.visual.quality.shadowsize, spec.visual.quality.offsamples = (4096, 4) if fine else (512, 0)
        if not fine:
            spec.visual.quality.numslices, spec.visual.quality.numstacks = _COARSE_FACETS
        spec.visual.headlight.ambient = [0.45] * 3
        spec.visual.headlight.diffuse = [0.35] * 3
        spec.visual.rgba.haze = [*_HORIZON_COLOUR, 1.0]
        spec.stat.extent = 1.0  # m, so that the lengths below are metres
        spec.visual.map.znear, spec.visual.map.zfar, spec.visual.map.shadowclip = 0.1, 100.0, shadow_radius
        spec.add_texture(
            name="sky", type=mujoco.mjtTexture.mjTEXTURE_SKYBOX, builtin=mujoco.mjtBuiltin.mjBUILTIN_GRADIENT,
            rgb1=_HORIZON_COLOUR, rgb2=[0.78, 0.82, 0.87], width=128, height=768,
        )  # fmt: skip
        self._model = spec.compile()
        self._data = mujoco.MjData(self._model)
        self._option, self._perturb = mujoco.MjvOption(), mujoco.MjvPerturb()
        self._renderer = mujoco.Renderer(self._model, height, width)

    def __enter__(self) -> Self:
        """Return the renderer."""
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        """Free the buffers."""
        self._renderer.close()

    def render(self, humanoids: list[PosedHumanoid], camera: Camera) -> np.ndarray:
        """Return a picture of humanoids, uint8, shape (height, width, 3)."""
        view = mujoco.MjvCamera()
        view.lookat[:] = camera.target
        view.distance, view.azimuth, view.elevation = camera.distance, np.degrees(camera.azimuth), _ELEVATION_DEG
        scene = self._renderer.scene
        for count, humanoid in enumerate(humanoids):
            self._data.qpos[:] = humanoid.pose
            self._data.qpos[:3] += humanoid.offset
            mujoco.mj_kinematics(self._model, self._data)
            mujoco.mj_comPos(self._model, self._data)
            if count == 0:  # ground, light and camera are added with the first humanoid
                mujoco.mj_camlight(self._model, self._data)
                self._data.light_xdir[:] = camera.light
                self._data.light_xpos[:] = camera.target - _LIGHT_DISTANCE_M * camera.light
                self._renderer.update_scene(self._data, view)
                first = next(i for i in range(scene.ngeom) if scene.geoms[i].type != mujoco.mjtGeom.mjGEOM_PLANE)
            else:
                first = scene.ngeom
                everything = mujoco.mjtCatBit.mjCAT_DYNAMIC
                mujoco.mjv_addGeoms(self._model, self._data, self._option, self._perturb, everything, scene)
            for i in range(first, scene.ngeom):
                scene.geoms[i].rgba[:] = humanoid.colour
        return self._renderer.render()


def render_pair(
    reference: np.ndarray, agent: np.ndarray, fps: float, lost: np.ndarray | None = None, size: tuple[int, int] = (640, 360)
) -> np.ndarray:
    """Return the frames of ``pair_frames`` as one array, uint8, shape (frames, height, width, 3); arguments are the same."""
    return np.stack(list(pair_frames(reference, agent, fps, lost, size)))


def pair_frames(
    reference: np.ndarray, agent: np.ndarray, fps: float, lost: np.ndarray | None = None, size: tuple[int, int] = (640, 360)
) -> Iterator[np.ndarray]:
    """Yield a video of the reference on the left and the agent on the right, the camera following the reference.

    Args:
        reference: Poses of the reference, shape (T, 50).
        agent: Poses of the agent, shape (T, 50).
        fps: Frame rate of both [1/s].
        lost: Whether the agent's episode had ended, so that it is shown in another colour, shape (T,).
        size: Width and height [pixels].

    Yields:
        Frames at ``VIDEO_FPS``, uint8, shape (height, width, 3).
    """
    shown = np.arange(0, len(reference), fps / VIDEO_FPS).round().astype(int)
    shown = shown[shown < len(reference)]
    path = _camera_path(reference[:, :3], fps)
    azimuth = float(heading(reference[0, 3:7])) + _VIEW_AZIMUTH_RAD
    with SceneRenderer(*size, _VIDEO_FIELD_DEG) as renderer:
        for t in shown:
            camera = Camera(path[t], _camera_distance(_VIDEO_HEIGHT_M, _VIDEO_FIELD_DEG), azimuth)
            colour = LOST_COLOUR if lost is not None and lost[t] else AGENT_COLOUR
            pair = [
                PosedHumanoid(reference[t], REFERENCE_COLOUR, -0.75 * camera.right),
                PosedHumanoid(agent[t], colour, 0.75 * camera.right),
            ]
            yield renderer.render(pair, camera)


def _camera_path(root: np.ndarray, fps: float) -> np.ndarray:
    """Return the camera's target for each root position (T, 3): smoothed, without a lag at either end."""
    sigma = _CAMERA_SMOOTHING_S * fps
    pad = min(round(4 * sigma), len(root) - 1)
    padded = np.pad(root, ((pad, pad), (0, 0)), mode="reflect", reflect_type="odd")
    path = gaussian_filter1d(padded, sigma, axis=0, mode="nearest")[pad : pad + len(root)]
    path[:, 2] = _CAMERA_TARGET_HEIGHT_M
    return path


def _camera_distance(height: float, field_of_view: float) -> float:
    """Return the distance [m] from which a picture shows a height [m] at a field of view [deg]."""
    return height / (2.0 * np.tan(np.radians(field_of_view) / 2.0))


def save_strip(path: Path, reference: np.ndarray, agent: np.ndarray, moments: int = 7, size: tuple[int, int] = (1600, 420)) -> None:
    """Write the picture of ``render_strip`` as PNG.

    Args:
        path: File to write.
        reference: Poses of the reference, shape (T, 50).
        agent: Poses of the agent, shape (T, 50).
        moments: Number of moments.
        size: Width and height [pixels].
    """
    mediapy.write_image(path, render_strip(reference, agent, moments, size))


def render_strip(reference: np.ndarray, agent: np.ndarray, moments: int = 7, size: tuple[int, int] = (1600, 420)) -> np.ndarray:
    """Return a picture of evenly spread moments, each with the agent and, as a ghost behind it, the reference.

    Args:
        reference: Poses of the reference, shape (T, 50).
        agent: Poses of the agent, shape (T, 50).
        moments: Number of moments.
        size: Width and height [pixels].

    Returns:
        Pixels, uint8, shape (height, width, 3).
    """
    width, height = size
    azimuth = float(heading(reference[0, 3:7])) + _VIEW_AZIMUTH_RAD
    camera = Camera(np.array([0.0, 0.0, _CAMERA_TARGET_HEIGHT_M]), _camera_distance(_STRIP_HEIGHT_M, _STRIP_FIELD_DEG), azimuth)
    spacing = _STRIP_HEIGHT_M * width / height / moments
    humanoids = []
    for place, t in enumerate(np.linspace(0, len(reference) - 1, moments).round().astype(int)):
        shift = spacing * (place - (moments - 1) / 2) * camera.right - reference[t, :3] * (1.0, 1.0, 0.0)
        humanoids.append(PosedHumanoid(agent[t], AGENT_COLOUR, shift))
        humanoids.append(PosedHumanoid(reference[t], (*REFERENCE_COLOUR[:3], GHOST_ALPHA), shift))
    with SceneRenderer(width, height, _STRIP_FIELD_DEG, shadow_radius=0.6 * spacing * moments, fine=True) as renderer:
        return renderer.render(humanoids, camera)


def encode_mp4(frames: Iterable[np.ndarray], fps: float = VIDEO_FPS) -> bytes:
    """Return frames (height, width, 3), one at least, as an H.264 video that browsers play; encoded while the next ones are made."""
    mediapy.set_ffmpeg(imageio_ffmpeg.get_ffmpeg_exe())
    coming = iter(frames)
    first = next(coming)
    with TemporaryDirectory() as folder:
        file = Path(folder) / "video.mp4"
        with mediapy.VideoWriter(file, first.shape[:2], fps=fps, codec="h264", crf=26, ffmpeg_args=_ENCODER_OPTIONS) as writer:
            for frame in chain([first], coming):
                writer.add_image(frame)
        return file.read_bytes()
