"""A training on a cluster of several nodes, which come and go; Ray starts them all on this machine."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import ray
from ray.cluster_utils import Cluster

from configs.errors import InputError
from configs.source_code import PROJECT_ROOT
from datasets.library.motion_library import MotionLibrary
from tests.trainers.conftest import standing
from tests.trainers.processes import descendants
from tests.trainers.run_comparison import final_state
from trainers.algorithms.ppo_config import CollectConfig, PpoConfig, RayConfig
from trainers.distributed.ray_cluster import RayCluster
from trainers.ppo import cli as ppo


@pytest.fixture
def head() -> Iterator[Cluster]:
    """A cluster whose head has one core, for the learner."""
    made = Cluster(initialize_head=True, head_node_args={"num_cpus": 1, "include_dashboard": False})
    yield made
    made.shutdown()


def training(cluster: Cluster, folder: Path, *settings: str) -> subprocess.Popen[str]:
    """Start a small run on a cluster."""
    command = [sys.executable, "-m", "tests.trainers.small_run", str(folder), f"ray.address={cluster.address}", *settings]
    return subprocess.Popen(command, cwd=PROJECT_ROOT, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)


def wait_for(folder: Path, iteration: int, process: subprocess.Popen[str]) -> None:
    """Return as soon as a small run has come to an iteration."""
    while not any(int(path.stem) >= iteration for path in folder.glob("small/checkpoints/*.safetensors")):
        assert process.poll() is None, process.communicate()[0]
        time.sleep(0.05)


class Where:
    """Tells where it is, and what it is without everything but the package that was sent there."""

    def where(self) -> tuple[str, str]:
        """Return the node, and the file from which a process imports the collector that knows nothing but what was sent."""
        sent = os.pathsep.join(path for path in sys.path if "runtime_resources" in path)
        told = {**os.environ, "PYTHONPATH": sent}
        code = "import trainers.collectors.cpu_collector as found, trainers.distributed.remote_learner; print(found.__file__)"
        done = subprocess.run([sys.executable, "-c", code], env=told, cwd="/", capture_output=True, text=True, check=True)
        return ray.get_runtime_context().get_node_id(), done.stdout.strip()


def test_actors_are_spread_and_are_sent_the_package(head: Cluster) -> None:
    for _ in range(2):
        head.add_node(num_cpus=1)
    config = PpoConfig(collect=CollectConfig(actors=2, threads=1), ray=RayConfig(str(head.address)))
    with RayCluster(config, MotionLibrary.from_clips([standing("one", "ann")]), np.ones(1)) as cluster:
        assert cluster.num_cores == 3
        found = cluster.ray.get([actor.where.remote() for actor in [cluster.start_actor(Where, 1) for _ in range(3)]])
    assert len({node for node, _ in found}) == 3
    assert all("runtime_resources" in file for _, file in found)


def test_a_learner_goes_where_a_gpu_is(head: Cluster) -> None:
    # Ray believes what it is told: the second node has a GPU, the others have none.
    config = PpoConfig(collect=CollectConfig(actors=1, threads=1), ray=RayConfig(str(head.address)))
    library = MotionLibrary.from_clips([standing("one", "ann")])
    head.add_node(num_cpus=1)
    with RayCluster(config, library, np.ones(1)) as cluster:
        assert [cluster.num_learner_gpus(device) for device in ("cpu", "auto")] == [0, 0]
        with pytest.raises(InputError, match="no node of the cluster has a GPU; should be cpu, or auto"):
            cluster.num_learner_gpus("cuda")
        with_gpu = head.add_node(num_cpus=1, num_gpus=1)
        assert [cluster.num_learner_gpus(device) for device in ("cpu", "auto", "cuda")] == [0, 1, 1]
        node, _ = cluster.ray.get(cluster.start_actor(Where, 1, gpus=1).where.remote())
    assert node == with_gpu.node_id


def test_a_node_is_lost_and_another_comes(head: Cluster, tmp_path: Path) -> None:
    nodes = [head.add_node(num_cpus=1) for _ in range(2)]
    with training(head, tmp_path, "samples=4096") as process:
        wait_for(tmp_path, 3, process)
        head.remove_node(nodes[0], allow_graceful=False)
        head.add_node(num_cpus=1)
        said, _ = process.communicate(timeout=120)
    assert process.returncode == 0, said
    assert "another" in said  # a collector, or the learner: who was on the node is Ray's choice
    assert final_state(tmp_path / "small")["clock"]["samples"] >= 4096


def test_the_learner_is_lost_and_another_goes_on_from_the_checkpoint(head: Cluster, tmp_path: Path) -> None:
    for _ in range(2):
        head.add_node(num_cpus=1)
    with training(head, tmp_path) as process:
        wait_for(tmp_path, 4, process)
        for pid in descendants(os.getpid(), "ray::LearnerActor"):
            os.kill(pid, signal.SIGKILL)
        said, _ = process.communicate(timeout=120)
    assert process.returncode == 0, said
    assert "another goes on from the newest checkpoint" in said
    assert final_state(tmp_path / "small")["clock"]["samples"] >= 20 * 64


def test_no_cluster_is_one_clear_line(tiny: PpoConfig) -> None:
    config = replace(tiny, collect=replace(tiny.collect, actors=1), ray=RayConfig("127.0.0.1:1"))
    with pytest.raises(InputError, match=r"ray\.address=127\.0\.0\.1:1: .*ray start --head"):
        ppo.train(config, resume=False)
