"""``python -m eval.live`` as people start and stop it, and ``eval.live_replay`` against it."""

import argparse
import asyncio
import os
import re
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path

import pytest
import torch
from rich.console import Console

from agents.lower_body.model import LowerBodyModel
from agents.lower_body.spec import LowerBodySpec
from configs.source_code import PROJECT_ROOT
from datasets.formats.bvh import read_bvh, write_bvh
from datasets.library.sources import load_clips
from datasets.retarget.humanoid_bvh import to_humanoid_bvh
from datasets.synthetic.clips import synthetic_clips
from eval import live_replay
from eval.clean.pipeline import CleaningPipeline
from eval.live import cli as live
from eval.live.client import play
from eval.live.virtual_user import replay_as_trackers
from tests.eval.live.live_parts import HOST, CheapBodies


def test_what_the_system_refuses_ends_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    options = argparse.Namespace(host=HOST, port=0, page_port=0, record=None, minutes=1.0)

    async def refuse_and_stop() -> None:
        serving = asyncio.create_task(live.serve(CheapBodies(1), options, Console()))
        await asyncio.sleep(0.2)
        loop = asyncio.get_running_loop()
        loop.call_exception_handler({"message": "socket.accept() out of system resource", "exception": OSError(24, "Too many open files")})
        await asyncio.sleep(0.05)
        assert not serving.done()
        loop.call_exception_handler({"message": "a fault", "exception": ValueError("of ours")})  # which does end it
        with pytest.raises(ValueError, match="of ours"):
            await asyncio.wait_for(serving, 5.0)

    asyncio.run(refuse_and_stop())
    assert "socket.accept() out of system resource: Too many open files" in capsys.readouterr().out


@pytest.fixture(scope="module")
def model(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a tiny network that knows nothing."""
    torch.manual_seed(0)
    path = tmp_path_factory.mktemp("model") / "model.safetensors"
    LowerBodyModel(LowerBodySpec(hidden=16)).save(path, {})
    return path


@pytest.fixture(scope="module")
def clip(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return six seconds of somebody who walks."""
    path = tmp_path_factory.mktemp("clip") / "walk.bvh"
    write_bvh(path, to_humanoid_bvh(next(clip for clip in synthetic_clips(0, 1, 6.0) if clip.kind == "walk")))
    return path


@contextmanager
def started(*arguments: str) -> Iterator[tuple[subprocess.Popen[str], int]]:
    """Start the service on a free port; yields the process and the port."""
    command = [sys.executable, "-m", "eval.live", "--port", "0", "--page-port", "0", *arguments]
    pipe = subprocess.PIPE
    with subprocess.Popen(
        command, cwd=PROJECT_ROOT, stdout=pipe, stderr=pipe, text=True, env={**os.environ, "PYTHONUNBUFFERED": "1"}
    ) as process:
        try:
            assert process.stdout
            found = re.match(r"trackers: 127\.0\.0\.1 port (\d+) \(TCP", process.stdout.readline())
            assert found, process.stderr and process.stderr.read()
            yield process, int(found[1])
        finally:
            process.kill()


def stopped(process: subprocess.Popen[str], number: signal.Signals) -> str:
    """Send a signal and return what was said until the end, which must be a good one."""
    process.send_signal(number)
    out, err = process.communicate(timeout=30.0)
    assert (process.returncode, err) == (0, "")
    return out


def test_replay_and_recording(model: Path, clip: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with started("--model", str(model), "--record", str(tmp_path / "takes")) as (process, port):
        code = live_replay.main([str(clip), "--port", str(port), "--speed", "3.5", "--height", "184"])
        said = capsys.readouterr()
        assert (code, said.err) == (0, "")
        sent = re.search(r"(\d+) of (\d+) frames answered, 1[0-9]{2}\.\d frames/s sent", said.out)
        assert sent, said.out
        assert sent[1] == sent[2]
        assert "toes: " in said.out
        with socket.create_connection(("127.0.0.1", port)) as half_open:  # somebody is there when it stops
            half_open.sendall(b'{"lobstr": 1, "axes": "z-up"}\n')
            half_open.recv(10)
            out = stopped(process, signal.SIGTERM)
    assert re.search(r"stopped after \d+ frames, latency median \d+\.\d\d ms, 99th percentile \d+\.\d\d ms", out)
    (file,) = (tmp_path / "takes").iterdir()
    assert f"saved {file}" in out
    bvh = read_bvh(file)
    assert len(bvh.values) == int(sent[1]) - 90  # a second of T-pose, a second to warm up
    (read,) = load_clips(file, fps=45.0)
    assert len(read) == len(bvh.values)
    cleaned, _ = CleaningPipeline(None).clean(bvh, file.stem)  # physics takes longer and is not in question here
    assert (cleaned.names, cleaned.values.shape) == (bvh.names, bvh.values.shape)


def test_stop_in_the_midst_of_a_session_saves_it_and_ends_the_page(model: Path, clip: Path, tmp_path: Path) -> None:
    with socket.create_server((HOST, 0)) as free:
        page_port = free.getsockname()[1]
    arguments = ("--model", str(model), "--record", str(tmp_path), "--page-port", str(page_port))
    with started(*arguments) as (process, port), ThreadPoolExecutor(1) as pool:
        trackers = replay_as_trackers(load_clips(clip, fps=45.0)[0], 1.7, 0).trackers
        playing = pool.submit(lambda: asyncio.run(play(trackers, "127.0.0.1", port)))  # 8 s
        end = time.monotonic() + 20.0
        while not list(tmp_path.iterdir()):  # until the first live frame
            assert time.monotonic() < end
            time.sleep(0.05)
        time.sleep(0.5)
        out = stopped(process, signal.SIGINT)
        assert playing.result(30.0).messages == ["the service stops"]
    assert f"page: http://127.0.0.1:{page_port}/" in out
    with pytest.raises(ConnectionRefusedError):
        socket.create_connection((HOST, page_port)).close()
    (file,) = tmp_path.iterdir()
    assert f"saved {file}" in out
    assert 1 < len(read_bvh(file).values) < len(trackers.positions) - 90


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["--port", "70000"], "--port is 70000, should be a port, 0 to 65535"),
        (["--page-port", "-1"], "--page-port is -1, should be a port, 0 to 65535"),
        (["--users", "0"], "--users is 0, should be 1 to 1000"),
        (["--minutes", "0"], "--minutes is 0.0, should be more than 0"),
        (["--minutes", "nan"], "--minutes is nan, should be more than 0"),
        (["--model", "none.safetensors"], "none.safetensors"),
        (["--record", "{file}/takes"], "cannot be made"),
        (["--port", "{taken}"], "Address already in use; choose others"),
        (["--port", "0", "--page-port", "{taken}"], "--page-port {taken}: Address already in use; choose another"),
        (["--host", "256.0.0.1", "--port", "0"], "--host 256.0.0.1"),
    ],
)
def test_bad_arguments(arguments: list[str], told: str, model: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "file").touch()
    with socket.create_server(("127.0.0.1", 0)) as taken:
        known = {"file": str(tmp_path / "file"), "taken": str(taken.getsockname()[1])}
        given = [argument.format(**known) for argument in arguments]
        assert live.main([*([] if "--model" in given else ["--model", str(model)]), *given]) == 2
        said = capsys.readouterr().err
    assert said.startswith("error: ")
    assert said.count("\n") == 1
    assert told.format(**known) in said
