"""A stream gives what the whole clip gives, as early as can be, and takes no bad frame."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from agents.root.model import RootModel
from agents.root.reconstruct import reconstruct_root
from agents.root.spec import RootSpec
from agents.root.stream import RootStream
from configs.errors import InputError
from datasets.motion.clip import BodyMotion
from datasets.motion.kinematics import resample
from tests.builders import lively

ROOT3D, POSE = RootSpec(), RootSpec(accelerations=False)
PLANAR, HEIGHT = RootSpec("planar_unet", accelerations=False), RootSpec("planar_unet", accelerations=False, vertical="height")
GRU, GRU_POSE = RootSpec("gru"), RootSpec("gru", accelerations=False)
SPECS = [
    *(GRU, GRU_POSE),
    *(ROOT3D, POSE, RootSpec(support=True), RootSpec(accelerations=False, support=True), RootSpec(target="com")),
    *(PLANAR, replace(PLANAR, target="com"), HEIGHT, replace(HEIGHT, target="com"), RootSpec("planar_cnn", accelerations=False)),
]
CLIP = resample(lively(), 100.0)  # 199 frames
JUMP = slice(100, 130)  # frames in which the sensors feel nothing


def untrained(spec: RootSpec) -> RootModel:
    """Return a model of random weights that make much of every input, with steps about as long as a person's."""
    torch.manual_seed(0)
    model = RootModel(spec).eval()
    for weights in model.network.parameters():
        if weights.ndim > 1:
            torch.nn.init.kaiming_normal_(weights)
    model.feature_mean.normal_(std=0.1)
    model.feature_std.uniform_(0.5, 2.0)
    model.target_std.fill_(0.02)
    return model


def measured(clip: BodyMotion) -> np.ndarray:
    """Return random accelerations (N, 19, 3), among them a jump."""
    accelerations = np.random.default_rng(0).normal(0.0, 2.0, (len(clip), 19, 3))
    accelerations[JUMP, :, 2] -= 9.81
    return accelerations


def streamed(stream: RootStream, clip: BodyMotion, accelerations: np.ndarray | None) -> np.ndarray:
    """Return the path (N, 3) that a stream gives of a clip; positions are spoilt once they have been read."""
    found = []
    for frame, rotations in enumerate(clip.local_rotations):
        position = stream.push(rotations, None if accelerations is None else accelerations[frame])
        assert (position is None) == (frame < stream.delay)
        if position is not None:
            found.append(position.copy())
            position[:] = np.nan
    rest = stream.finish()
    assert rest.shape == (stream.delay, 3)
    return np.concatenate([np.reshape(found, (-1, 3)), rest])


@pytest.mark.parametrize("filtered", [True, False])
@pytest.mark.parametrize("spec", SPECS)
def test_a_stream_gives_the_path_of_the_whole_clip(spec: RootSpec, filtered: bool) -> None:
    model, accelerations = untrained(spec), measured(CLIP) if spec.accelerations else None
    whole = reconstruct_root(model, CLIP, accelerations, filtered=filtered).root_position
    assert np.diff(whole, axis=0).std(axis=0).max() > 1e-4  # no two steps are alike
    np.testing.assert_allclose(streamed(RootStream(model, filtered=filtered), CLIP, accelerations), whole, atol=1e-6, rtol=0)


def test_accelerations_that_only_the_filters_use_count_as_well() -> None:
    model, accelerations = untrained(POSE), measured(CLIP)
    whole = reconstruct_root(model, CLIP, accelerations).root_position
    assert np.abs(whole - reconstruct_root(model, CLIP).root_position).max() > 0.1  # it flies
    np.testing.assert_allclose(streamed(RootStream(model), CLIP, accelerations), whole, atol=1e-6, rtol=0)


def test_planar_models_do_not_fly() -> None:
    model = untrained(PLANAR)
    whole = reconstruct_root(model, CLIP).root_position
    np.testing.assert_allclose(streamed(RootStream(model), CLIP, measured(CLIP)), whole, atol=1e-6, rtol=0)


@pytest.mark.parametrize("more", [0, 1, 2, 3, 4])
@pytest.mark.parametrize("spec", [ROOT3D, PLANAR, HEIGHT, GRU, GRU_POSE])
def test_clips_hardly_longer_than_a_window(spec: RootSpec, more: int) -> None:
    clip, model = CLIP.cut(0, spec.window + more), untrained(spec)
    accelerations = measured(CLIP)[: len(clip)] if spec.accelerations else None
    whole = reconstruct_root(model, clip, accelerations).root_position
    np.testing.assert_allclose(streamed(RootStream(model), clip, accelerations), whole, atol=1e-6, rtol=0)


@pytest.mark.parametrize("order", [0, 3])
def test_orders(order: int) -> None:
    model = untrained(POSE)
    whole = reconstruct_root(model, CLIP, order=order).root_position
    np.testing.assert_allclose(streamed(RootStream(model, order), CLIP, None), whole, atol=1e-6, rtol=0)


@pytest.mark.parametrize(
    ("spec", "delay"),
    # Frame 1 is where the step of window 0 leads, and 6 of Root3D's 8 frames come after it, 62 of the planar models' 64.
    # The height of frame 0 needs all of window 0: 63 frames come after it.
    # The recurrent network's patch of frames 0 to 7 tells the step into frame 1.
    [(POSE, 6), (PLANAR, 62), (HEIGHT, 63), (GRU_POSE, 6)],
)
def test_the_delay_is_that_of_the_last_window_with_a_say(spec: RootSpec, delay: int) -> None:
    assert RootStream(untrained(spec)).delay == delay


def test_a_position_makes_use_of_the_frame_that_has_just_come() -> None:
    stream, other = (RootStream(untrained(POSE), filtered=False) for _ in range(2))
    for rotations in CLIP.local_rotations[:7]:
        stream.push(rotations)
        other.push(rotations)
    position, changed = stream.push(CLIP.local_rotations[7]), other.push(CLIP.local_rotations[150])
    assert position is not None
    assert changed is not None
    assert np.abs(position - changed).max() > 1e-4


def test_a_stream_starts_over_after_its_end() -> None:
    stream, other = RootStream(untrained(POSE)), CLIP.cut(50, 150)
    streamed(stream, CLIP, None)
    assert np.array_equal(streamed(stream, other, None), streamed(RootStream(untrained(POSE)), other, None))


def test_too_short_a_performance_says_what_is_needed_and_may_go_on() -> None:
    stream = RootStream(untrained(POSE))
    for rotations in CLIP.local_rotations[:7]:
        stream.push(rotations)
    with pytest.raises(InputError, match=r"7 frames at 100 Hz is too short for root3d, which needs 8 \(0.08 s\)"):
        stream.finish()
    stream.push(CLIP.local_rotations[7])
    assert stream.finish().shape == (6, 3)


def with_number(array: np.ndarray, at: tuple[int, int], number: float) -> np.ndarray:
    """Return an array with one other number."""
    changed = array.copy()
    changed[at] = number
    return changed


GOOD, FELT = CLIP.local_rotations[20], measured(CLIP)[20]


@pytest.mark.parametrize(
    ("rotations", "accelerations", "message"),
    [
        (with_number(GOOD, (3, 1), np.nan), FELT, "frame 20 of the stream: rotation of head is .*nan.*should be a quaternion of length 1"),
        (with_number(GOOD, (0, 0), 3.0), FELT, "frame 20 of the stream: rotation of pelvis is .*should be a quaternion of length 1"),
        (GOOD[:19], FELT, r"frame 20 of the stream: rotations have shape \(19, 4\), should be \(20, 4\)"),
        (GOOD, with_number(FELT, (1, 2), np.inf), "frame 20 of the stream: acceleration of chest is not a finite number"),
        (GOOD, FELT[:7], r"frame 20 of the stream: accelerations have shape \(7, 3\), should be \(19, 3\)"),
        (GOOD, None, "frame 20 of the stream: the model needs the sensors' accelerations; without sensors use one trained with"),
    ],
)
def test_a_bad_frame_is_named_and_changes_nothing(rotations: np.ndarray, accelerations: np.ndarray | None, message: str) -> None:
    model, clip, felt = untrained(ROOT3D), CLIP.cut(0, 40), measured(CLIP)[:40]
    stream = RootStream(model)
    found = [stream.push(clip.local_rotations[frame], felt[frame]) for frame in range(20)]
    with pytest.raises(InputError, match=message) as error:
        stream.push(rotations, accelerations)
    assert "\n" not in str(error.value)
    found += [stream.push(clip.local_rotations[frame], felt[frame]) for frame in range(20, 40)]
    path = np.stack([position for position in found if position is not None])
    assert np.array_equal(np.concatenate([path, stream.finish()]), streamed(RootStream(model), clip, felt))


@pytest.mark.parametrize(("first", "second", "message"), [(FELT, None, "are missing, should come"), (None, FELT, "are there, should come")])
def test_accelerations_come_always_or_never(first: np.ndarray | None, second: np.ndarray | None, message: str) -> None:
    stream = RootStream(untrained(POSE))
    stream.push(GOOD, first)
    with pytest.raises(InputError, match=f"frame 1 of the stream: accelerations {message}"):
        stream.push(GOOD, second)
