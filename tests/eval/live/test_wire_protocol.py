"""The lines of the live protocol: axis systems worked out by hand, and whatever cannot be a line."""

import json
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from configs.errors import InputError
from datasets.motion.humanoid import BODY_COUNT, BODY_NAMES
from datasets.trackers.trackers import ALL_TRACKER_NAMES, HEAD_TRACKER, TRACKER_NAMES
from eval.live.wire_protocol import AXIS_SYSTEMS, MAX_FRAME_NUMBER, CalibrationRequest, Codec, TrackerFrame, read_hello
from tests.eval.live.live_parts import STANDING

HALF = float(np.sqrt(0.5))  # sine and cosine of 45 degrees


def line(**changes: Any) -> bytes:
    return json.dumps({"frame": 7, **STANDING, **changes}).encode()


def read(codec: Codec, text: bytes) -> TrackerFrame:
    frame = codec.read(text)
    assert isinstance(frame, TrackerFrame)
    return frame


@pytest.mark.parametrize(
    ("axes", "place", "turn"),
    [
        # Somebody 3 m ahead, 1 m to the left, 2 m up, who has turned left by 90 degrees about the vertical
        ("z-up", [3, 1, 2], [HALF, 0, 0, HALF]),
        ("openxr", [-1, 2, -3], [HALF, 0, HALF, 0]),  # x right, y up, -z ahead; right-handed: left is a positive turn about y
        ("unity", [-1, 2, 3], [HALF, 0, -HALF, 0]),  # x right, y up, z ahead; left-handed: a positive turn about y is to the right
    ],
)
def test_axes(axes: str, place: list[float], turn: list[float]) -> None:
    codec = Codec.of(axes)
    trackers = read(codec, line(head=[*place, *turn])).trackers
    np.testing.assert_allclose(trackers.positions[HEAD_TRACKER], [3, 1, 2])
    np.testing.assert_allclose(trackers.rotations[HEAD_TRACKER], [HALF, 0, 0, HALF])
    rotations = np.tile(trackers.rotations[HEAD_TRACKER], (BODY_COUNT, 1))
    answer = json.loads(codec.answer(7, "live", trackers.positions[HEAD_TRACKER], rotations, np.array([True, False]), 1.25, 2.5))
    np.testing.assert_allclose(answer.pop("root"), place)
    np.testing.assert_allclose(answer.pop("rotations"), [turn] * BODY_COUNT, atol=1e-5)
    assert answer == {"frame": 7, "state": "live", "contacts": [True, False], "scale": 1.25, "latency_ms": 2.5}


def test_skeleton_in_the_clients_axes() -> None:
    for axes, ahead in (("z-up", [0.13, 0, -0.06]), ("openxr", [0, -0.06, -0.13]), ("unity", [0, -0.06, 0.13])):
        welcome = json.loads(Codec.of(axes).welcome(3))
        toe = welcome["bodies"].index("toe_l")  # 13 cm ahead of the ankle, 6 cm lower
        np.testing.assert_allclose(welcome["offsets"][toe], ahead, atol=1e-9)
        assert welcome["bodies"][welcome["parents"][toe]] == "foot_l"
        assert (welcome["lobstr"], welcome["fps"], welcome["user"], welcome["axes"]) == (1, 45.0, 3, axes)
        assert tuple(welcome["bodies"]) == BODY_NAMES


@given(st.sampled_from(AXIS_SYSTEMS), st.integers(0, MAX_FRAME_NUMBER), st.integers(0, 2**32 - 1))
def test_frames_come_back(axes: str, number: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    rotations = rng.normal(size=(8, 4))
    trackers = read(Codec.of("z-up"), line()).trackers
    trackers = trackers._replace(
        positions=rng.uniform(-5, 5, (8, 3)), rotations=rotations / np.linalg.norm(rotations, axis=1, keepdims=True)
    )
    trackers.positions[7] = np.nan  # an IMU
    codec = Codec.of(axes, trackers=ALL_TRACKER_NAMES)
    back = read(codec, codec.frame(number, trackers))
    assert back.number == number
    np.testing.assert_allclose(back.trackers.positions, trackers.positions, atol=1e-6)
    np.testing.assert_allclose(back.trackers.rotations, trackers.rotations, atol=2e-6)


def test_a_lost_tracker_is_null() -> None:
    codec = Codec.of("unity")
    frame = read(codec, line(hand_l=None))
    assert np.isnan(frame.trackers.positions[1]).all()
    assert np.isnan(frame.trackers.rotations[1]).all()
    assert np.isfinite(frame.trackers.positions[[0, 2, 3]]).all()
    assert np.isnan(frame.trackers.positions[4:]).all()  # not worn
    assert json.loads(codec.frame(7, frame.trackers))["hand_l"] is None


def test_trackers_beyond_the_usual_ones_come_in_the_hello() -> None:
    codec = read_hello(json.dumps({"lobstr": 1, "axes": "z-up", "trackers": ["shin_l", "head", "hand_r", "hand_l", "foot_r"]}).encode())
    assert codec.trackers == ("head", "hand_l", "hand_r", "foot_r", "shin_l")
    assert codec.worn.tolist() == [True, True, True, False, False, True, True, False]
    assert json.loads(codec.welcome(1))["trackers"] == list(codec.trackers)
    body = {name: STANDING[name] for name in ("head", "hand_l", "hand_r")}
    frame = read(codec, json.dumps({"frame": 1, **body, "foot_r": [0.1, -0.2, 0.1, 1, 0, 0, 0], "shin_l": [HALF, 0, 0, HALF]}).encode())
    assert frame.trackers.positions[5] == pytest.approx([0.1, -0.2, 0.1])
    assert frame.trackers.rotations[6] == pytest.approx([HALF, 0, 0, HALF])  # of an IMU, whose place is not known
    assert np.isnan(frame.trackers.positions[6]).all()
    assert np.isnan(frame.trackers.rotations[3]).all()
    assert list(json.loads(codec.frame(1, frame.trackers))) == ["frame", *codec.trackers]
    with pytest.raises(InputError, match='"foot_r" is missing'):
        codec.read(json.dumps({"frame": 2, **body, "shin_l": None}).encode())
    with pytest.raises(InputError, match='"pelvis" is unknown'):
        codec.read(json.dumps({"frame": 2, **STANDING, "foot_r": None, "shin_l": None}).encode())


@pytest.mark.parametrize(
    "trackers", [[], ["head", "hand_l"], "head", [*TRACKER_NAMES, "tail"], [*TRACKER_NAMES, "head"], [*TRACKER_NAMES, 1]]
)
def test_trackers_that_cannot_be(trackers: object) -> None:
    with pytest.raises(
        InputError, match=r'"trackers" is .*, should be head, hand_l, hand_r and any of pelvis, foot_l, foot_r, shin_l, shin_r'
    ):
        read_hello(json.dumps({"lobstr": 1, "axes": "z-up", "trackers": trackers}).encode())


def test_rough_quaternions_are_made_unit() -> None:
    frame = read(Codec.of("z-up"), line(pelvis=[0, 0, 1, 0.95, 0, 0, 0]))
    np.testing.assert_allclose(frame.trackers.rotations[TRACKER_NAMES.index("pelvis")], [1, 0, 0, 0])


def test_calibrate() -> None:
    assert isinstance(Codec.of("z-up").read(b'{"calibrate": true}'), CalibrationRequest)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (b"", "no JSON"),
        (b"{", "no JSON"),
        (b"GET / HTTP/1.1\r", "no JSON"),
        (b"\xff\xfe{}", "not UTF-8"),
        (b"[" * 60000, "no JSON"),
        (b"[1, 2]", "one JSON object"),
        (b"null", "one JSON object"),
        (b"1" * 5000, "no JSON"),
        (b'{"calibrate": 1}', "calibrate"),
        (b'{"calibrate": true, "frame": 1}', "calibrate"),
        (b"{}", '"frame" is missing'),
        (line(frame="1"), '"frame" is "1"'),
        (line(frame=True), '"frame" is true'),
        (line(frame=1.5), '"frame" is 1.5'),
        (line(frame=-1), '"frame" is -1'),
        (line(frame=2**60), '"frame" is 115'),
        (line(foot=[0] * 7), '"foot" is unknown'),
        (line(head="lost"), '"head" should be seven numbers'),
        (line(head=[0, 0, 1]), '"head" should be seven numbers'),
        (line(head=[1, 0, 0, 0]), '"head" should be seven numbers'),
        (line(head=[0, 0, 1, 1, 0, 0, 0, 0]), '"head" should be seven numbers'),
        (line(head=[0, 0, "1", 1, 0, 0, 0]), '"head" should be seven numbers'),
        (line(head=[0, 0, True, 1, 0, 0, 0]), '"head" should be seven numbers'),
        (line(head={"x": 1}), '"head" should be seven numbers'),
        (line(head=[0, 0, float("nan"), 1, 0, 0, 0]), "NaN is no number"),
        (line(head=[0, 0, float("inf"), 1, 0, 0, 0]), "Infinity is no number"),
        (line().replace(b"1.7", b"1e999"), '"head" holds a number that is not finite'),
        (line(hand_r=[0, 0, 10**400, 1, 0, 0, 0]), "not finite"),
        (line(hand_l=[0, 0, 170, 1, 0, 0, 0]), '"hand_l" is at 0, 0, 170, should be within 100 m of the origin; metres?'),
        (line(pelvis=[0, 0, 1, 0, 0, 0, 0]), 'the quaternion of "pelvis" has length 0, should have 1'),
        (line(pelvis=[0, 0, 1, 2, 0, 0, 0]), "length 2"),
        (line(pelvis=[0, 0, 1, 1e200, 1e200, 0, 0]), "length inf"),
    ],
)
def test_what_is_no_frame(text: bytes, told: str) -> None:
    with pytest.raises(InputError) as caught:
        Codec.of("z-up").read(text)
    assert told in str(caught.value)
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 300


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (b"GET / HTTP/1.1\r", 'the first line should be {"lobstr": 1'),
        (line(), 'the first line should be {"lobstr": 1'),
        (b'{"lobstr": 2, "axes": "z-up"}', '"lobstr" is 2, should be 1'),
        (b'{"lobstr": true, "axes": "z-up"}', '"lobstr" is true, should be 1'),
        (b'{"lobstr": 1}', '"axes" is missing'),
        (b'{"lobstr": 1, "axes": "y"}', '"axes" is "y", should be one of z-up, openxr, unity'),
        (b'{"lobstr": 1, "axes": ["z-up"]}', '"axes" is ["z-up"], should be one of'),
        (b'{"lobstr": 1, "axes": "z-up", "fps": 90}', '"fps" is unknown'),
        (b'{"lobstr": 1, "axes": "z-up", "name": 5}', '"name" is 5'),
        (b'{"lobstr": 1, "axes": "z-up", "name": "\\u001b[2J"}', '"name" is "\\u001b[2J", should be at most 40 printable'),
        (json.dumps({"lobstr": 1, "axes": "z-up", "name": "x" * 41}).encode(), "at most 40 printable characters"),
    ],
)
def test_what_is_no_hello(text: bytes, told: str) -> None:
    with pytest.raises(InputError) as caught:
        read_hello(text)
    assert told in str(caught.value)


def test_hello() -> None:
    codec = read_hello(b'{"lobstr": 1, "axes": "unity", "name": "Ann\\u00e9"}')
    assert (codec.axes, codec.name) == ("unity", "Ann\u00e9")
