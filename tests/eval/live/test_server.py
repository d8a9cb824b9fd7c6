"""The live service over real sockets: answers to good clients, errors for bad ones, and no effect of these on those."""

import asyncio
import json
import socket
import time
from contextlib import suppress
from dataclasses import replace

from eval.live.rate_limit import ClientLimits
from eval.live.server import MAX_UNIDENTIFIED_CONNECTIONS
from eval.live.wire_protocol import MAX_LINE_BYTES
from tests.eval.live.live_parts import CALIBRATION, CALM, HELLO, HOST, SCALE, STANDING, WARM, CheapBodies, Client, Service, run, serving


async def goes_on(client: Client) -> None:
    """Check that a client is served as if it were alone."""
    for answer in await client.frames(5):
        assert answer["frame"] <= client.number
        assert "error" not in answer


def test_calibrates_warms_up_and_is_live() -> None:
    async def test() -> None:
        async with serving() as service:
            client = await service.client(name="Ann")
            answers = await client.frames(CALIBRATION + WARM + 2)
            states = ["calibrating"] * CALIBRATION + ["warming up"] * WARM + ["live"] * 2
            assert [answer["state"] for answer in answers] == states
            assert [answer["frame"] for answer in answers] == list(range(1, 8))
            assert answers[-1]["root"] == STANDING["pelvis"][:3]
            assert answers[-1]["rotations"] == [[1.0, 0.0, 0.0, 0.0]] * 20
            assert answers[-1]["contacts"] == [True, False]
            assert answers[-1]["scale"] == SCALE
            assert 0.0 < answers[-1]["latency_ms"] < 5000.0
            assert service.server.users == 1
        assert service.notes == ["user 1 (Ann): came", "user 1 (Ann): the service stops"]

    run(test())


def test_bad_t_pose_and_another_calibration() -> None:
    async def test() -> None:
        async with serving() as service:
            client = await service.client()
            low = [0.0, 0.0, 0.9, 1.0, 0.0, 0.0, 0.0]
            await client.frame(head=low)
            await client.frame(head=low)
            told = await client.frame(head=low)
            assert told == {"error": "T-pose: the head is low; calibration begins again", "closing": False}
            assert (await client.line())["state"] == "calibrating"
            assert [answer["state"] for answer in await client.frames(CALIBRATION + WARM + 1)][-1] == "live"
            client.send({"calibrate": True})
            assert (await client.frame())["state"] == "calibrating"

    run(test())


def test_a_calibration_is_begun_after_the_frames_that_came_before() -> None:
    async def test() -> None:
        async with serving() as service:
            client = await service.client()
            await client.frames(CALIBRATION + WARM)
            lines = [{"frame": 11, **STANDING}, {"frame": 12, **STANDING}, {"calibrate": True}, {"frame": 13, **STANDING}]
            client.send(b"".join(json.dumps(line).encode() + b"\n" for line in lines))
            answers = [await client.line() for _ in range(3)]
            assert [(answer["frame"], answer["state"]) for answer in answers] == [(11, "live"), (12, "live"), (13, "calibrating")]

    run(test())


def test_a_body_that_cannot_be_found_is_told_and_disturbs_nobody() -> None:
    async def test() -> None:
        async with serving() as service:
            lost, good = await service.client(), await service.client()
            await lost.frames(CALIBRATION + WARM)
            told = await lost.frame(pelvis=[95.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0])
            assert told == {"error": "no body could be found for frame 6; calibration begins again", "closing": False}
            await goes_on(good)
            assert (await lost.frame())["state"] == "calibrating"

    run(test())


def test_the_last_frame_of_a_bad_t_pose_is_answered_before_the_end() -> None:
    async def test() -> None:
        async with serving() as service:
            client = await service.client()
            for number in range(CALIBRATION):
                client.send({"frame": number, **STANDING, "head": [0.0, 0.0, 0.9, 1.0, 0.0, 0.0, 0.0]})
            client.writer.write_eof()
            told = await client.last_words()
            assert [line.get("frame") for line in told] == [0, 1, None, 2]
            assert told[2]["error"].startswith("T-pose")
            await service.until(lambda: not service.server.views)

    run(test())


def test_users_who_come_together_are_solved_together() -> None:
    async def test() -> None:
        async with serving(users=4) as service:
            clients = [await service.client() for _ in range(4)]
            bodies = service.server.solver
            assert isinstance(bodies, CheapBodies)
            for _ in range(10):
                await asyncio.gather(*(client.frame() for client in clients))
            assert sum(bodies.batches) == 40
            assert max(bodies.batches) == 4
            assert len(bodies.batches) < 25

    run(test())


def test_each_user_has_a_place_of_its_own() -> None:
    async def test() -> None:
        async with serving(users=2) as service:
            ann, bob = await service.client(), await service.client()
            await ann.frames(CALIBRATION + WARM)
            assert (await bob.frame(pelvis=[5.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0]))["state"] == "calibrating"
            assert (await ann.frame())["state"] == "live"
            refused = await (await service.connect()).ask({"lobstr": 1, "axes": "z-up"})
            assert refused["error"].startswith("all 2 places are taken")
            assert refused["closing"]
            bob.writer.transport.abort()  # a dropped connection
            await service.until(lambda: service.server.users == 1)
            assert (await ann.frame())["state"] == "live"
            assert (await (await service.client()).frame())["state"] == "calibrating"  # and not where Bob was

    run(test())


def test_wrong_lines_are_told_and_forgiven() -> None:
    async def test() -> None:
        async with serving(limits=replace(CALM, max_bad_lines=20)) as service:
            good, bad = await service.client(), await service.client()
            for wrong, told in (
                (b"nonsense\n", "no JSON"),
                (b'{"frame": 1}\n', '"head" is missing'),
                (b"\n", "no JSON"),
                (b"\xff\xfe\n", "not UTF-8"),
                (b"[" * 50_000 + b"\n", "no JSON"),
                (json.dumps({"frame": 1, **STANDING, "head": [float("nan")] * 7}).encode() + b"\n", "NaN"),
            ):
                answer = await bad.ask(wrong)
                assert told in answer["error"]
                assert not answer["closing"]
                await goes_on(good)
            assert (await bad.frame())["frame"] == 1
            assert (await bad.ask({"frame": 1, **STANDING}))["error"] == '"frame" is 1 after 1, should be greater'
            for _ in range(21):
                bad.send(b"nonsense\n")
            last = (await bad.last_words())[-1]
            assert last["closing"]
            assert last["error"].startswith("21 wrong lines in a row") or last["error"].startswith("22")
            await goes_on(good)

    run(test())


def test_first_line_must_be_a_hello() -> None:
    async def test() -> None:
        async with serving() as service:
            browser = await service.connect()
            browser.send(b"POST / HTTP/1.1\r\nHost: localhost\r\n\r\n" + json.dumps({"frame": 1, **STANDING}).encode() + b"\n")
            told = await browser.last_words()
            assert len(told) == 1
            assert told[0]["closing"]
            assert '{"lobstr": 1, "axes":' in told[0]["error"]
            assert service.server.users == 0

    run(test())


def test_lines_without_end() -> None:
    async def test() -> None:
        async with serving() as service:
            good = await service.client()
            for tail in (b"", b"\n"):
                endless = await service.client()
                endless.send(b" " * (MAX_LINE_BYTES + 1) + tail)
                assert (await endless.last_words()) == [{"error": "a line is longer than 65536 bytes", "closing": True}]
            await goes_on(good)
            assert service.server.users == 1

    run(test())


def test_a_flood_is_dropped_and_nobody_else_waits() -> None:
    async def test() -> None:
        async with serving() as service:
            good, flooder = await service.client(), await service.client()
            for number in range(20_000):
                flooder.send({"frame": number, **STANDING})
            flooding = asyncio.create_task(flooder.last_words())
            delays, waiting = [], 0
            while not flooding.done():
                waiting = max(waiting, *(len(session.waiting) for session in service.server._sessions))
                begin = time.perf_counter()
                await goes_on(good)
                delays.append((time.perf_counter() - begin) / 5)
                await asyncio.sleep(0.005)
            told = flooding.result()[-1]
            assert told["closing"]
            # Both limits are 450 lines: which is met first depends on whether any was answered meanwhile.
            assert told["error"].startswith(("a flood: more than 180 lines a second", "450 frames wait: more come than can be answered"))
            assert len(flooding.result()) < 1000  # of its 20,000 frames
            assert waiting <= 450  # what is kept of a flood
            assert sorted(delays)[len(delays) // 2] < 0.1
            assert service.server.users == 1
            await goes_on(good)

    run(test())


def test_a_flood_that_goes_on_after_the_error_is_cut() -> None:
    async def test() -> None:
        async with serving() as service:
            flooder = await service.connect()
            flooder.send(b"no hello\n")
            flooder.send(b"x" * (16 * 1024 * 1024))
            with suppress(ConnectionError):
                while await asyncio.wait_for(flooder.reader.read(65536), 5.0):
                    pass
            await service.until(lambda: not service.server._sessions)

    run(test())


def test_frames_that_wait_are_answered_before_the_end() -> None:
    async def test() -> None:
        async with serving() as service:
            client = await service.client()
            for number in range(100):
                client.send({"frame": number, **STANDING})
            client.writer.write_eof()
            assert [answer["frame"] for answer in await client.last_words()] == list(range(100))
            await service.until(lambda: service.server.users == 0)
            assert service.notes[-1] == "user 1: left"

    run(test())


def test_who_is_silent_is_sent_away() -> None:
    async def test() -> None:
        async with serving(limits=replace(CALM, max_idle_s=0.4)) as service:
            stranger, silent, good = await service.connect(), await service.client(), await service.client()
            gone = asyncio.gather(stranger.last_words(), silent.last_words())
            while not gone.done():
                await goes_on(good)
                await asyncio.sleep(0.02)
            assert gone.result() == [
                [{"error": "no first line for 0.4 s", "closing": True}],
                [{"error": "no frame for 0.4 s", "closing": True}],
            ]
            assert service.server.users == 1

    run(test())


def test_who_does_not_read_is_dropped() -> None:
    async def test(deaf: socket.socket) -> None:
        async with serving(limits=replace(CALM, max_waiting_lines=100_000, max_lines_per_s=1e9, max_unread_bytes=32 * 1024)) as service:
            good = await service.client()
            deaf.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
            deaf.setblocking(False)
            loop = asyncio.get_running_loop()
            await loop.sock_connect(deaf, (HOST, service.port))
            await loop.sock_sendall(deaf, b'{"lobstr": 1, "axes": "z-up"}\n')
            await service.until(lambda: service.server.users == 2)
            number = 0
            while service.server.users == 2:
                await loop.sock_sendall(deaf, b"".join(json.dumps({"frame": number + k, **STANDING}).encode() + b"\n" for k in range(50)))
                number += 50
                await goes_on(good)
                assert number < 50_000
            assert "user 2: does not read its answers: 32768 bytes wait" in service.notes
            await goes_on(good)

    with socket.socket() as deaf:
        run(test(deaf))


def test_a_wrong_rate_is_told_once() -> None:
    async def test() -> None:
        async with serving(limits=ClientLimits(max_waiting_lines=100_000, max_lines_per_s=1e9, rate_window_s=0.2)) as service:
            client = await service.client()
            answers = []
            for _ in range(30):
                answers.append(await client.frame())
                await asyncio.sleep(0.04)  # so at most 25 frames a second
            told = [answer["warning"] for answer in answers if "warning" in answer]
            assert len(told) == 1
            assert "should be 45: legs will move at a wrong pace" in told[0]
            assert sum("warned" in note for note in service.notes) == 1

    run(test())


def test_strangers_do_not_crowd_users_out() -> None:
    async def test() -> None:
        async with serving() as service:
            good = await service.client()
            strangers = [await service.connect() for _ in range(MAX_UNIDENTIFIED_CONNECTIONS + 1)]
            assert (await strangers[-1].line())["error"].startswith("too many connections have not said hello")
            await goes_on(good)
            assert (await strangers[0].ask(HELLO))["lobstr"] == 1  # which makes room
            await goes_on(await service.client())

    run(test())


async def misbehave(service: Service, kind: int) -> None:
    """Do one of four things that no client should, until the service hangs up."""
    client = await service.connect()
    client.send({"lobstr": 1, "axes": "unity"})
    if kind == 0:
        client.send(b"\x00" * 100_000)
    elif kind == 1:
        for number in range(3000):
            client.send({"frame": number, **STANDING})
    elif kind == 2:
        client.send({"frame": 1, **STANDING})
        client.writer.transport.abort()
    else:
        client.send(b'{"frame": NaN}\n' * 500)
    with suppress(ConnectionError):
        while await asyncio.wait_for(client.reader.read(65536), 5.0):
            pass


def test_all_at_once() -> None:
    """Bad clients of every kind together, again and again: three good ones get every answer."""

    async def good(service: Service, until: asyncio.Event) -> int:
        client = await service.client()
        while not until.is_set():
            await goes_on(client)
            await asyncio.sleep(0.01)
        return client.number

    async def test() -> None:
        async with serving(users=10) as service:
            over = asyncio.Event()
            people = [asyncio.create_task(good(service, over)) for _ in range(3)]
            for _ in range(3):
                await asyncio.gather(*(misbehave(service, kind) for kind in range(4)))
            over.set()
            assert min(await asyncio.gather(*people)) >= 5
            await service.until(lambda: service.server.users == 3)
            assert not service.server._waiting

    run(test())


def test_a_connection_that_is_only_being_made_does_not_hold_the_end_up() -> None:
    async def test() -> None:
        async with serving() as service:
            session = service.server._connect()  # as asyncio does, a moment before it tells of the connection
            session.close("the service stops")
            assert not session.ended  # there is nobody to tell yet

    run(test())
