"""Workers of a campaign: processes that end with it, and those of a Dask cluster."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import numpy as np
import pytest

from lariat.configuration import ConfigurationError
from lariat.rod import Rod, RodProperties, RolloutSpec
from stack import workers
from stack.workers import compute

ROOT = str(Path(workers.__file__).parents[1])

PROGRAM = """
import sys
from stack.workers import compute
from tests.stack.test_workers import wait
if __name__ == "__main__":
    for _ in compute(wait, [sys.argv[1]] * 2, 2):
        pass
"""


def wait(folder: str) -> None:
    """Name this process in a folder and compute for a minute."""
    Path(folder, str(os.getpid())).touch()
    time.sleep(60.0)


def last_positions(seed: int) -> bytes:
    """Bytes of the nodes of a rod after a random motion."""
    rod = Rod(RodProperties(0.45, 0.008, 0.044, 1e6), 20)
    actions = np.random.default_rng(seed).uniform(-0.2, 0.2, size=(5, 2, 6))
    start = rod.straight([-0.2, 0.0, 0.3], [0.2, 0.0, 0.3])
    return rod.rollout(RolloutSpec(start, actions, 0.02)).final.positions.tobytes()


def process_id(_: int) -> int:
    """Process that computes this."""
    return os.getpid()


@pytest.fixture
def dask() -> Iterator[Callable[..., subprocess.Popen[str]]]:
    """Start a command of Dask, and end it with the test."""
    with ExitStack() as stack:

        def start(*arguments: str) -> subprocess.Popen[str]:
            command = [sys.executable, "-m", "dask", *arguments]
            process = subprocess.Popen(
                command, env={**os.environ, "PYTHONPATH": ROOT}, stderr=subprocess.PIPE, text=True
            )
            stack.callback(process.wait)
            stack.callback(process.terminate)
            return process

        yield start


@pytest.fixture
def scheduler(dask: Callable[..., subprocess.Popen[str]]) -> str:
    """Address of a scheduler on a free port."""
    arguments = ("--host", "127.0.0.1", "--port", "0", "--no-dashboard", "--no-jupyter")
    process = dask("scheduler", *arguments)
    assert process.stderr is not None
    for line in process.stderr:
        if "Scheduler at:" in line:
            return line.split()[-1]
    raise AssertionError("the scheduler did not start")


@pytest.fixture
def add_worker(dask: Callable[..., subprocess.Popen[str]], scheduler: str) -> Callable[..., None]:
    """Start workers of the scheduler, and wait for the first."""

    def start(count: int, threads: int = 1) -> None:
        options = ("--nworkers", str(count), "--nthreads", str(threads), "--host", "127.0.0.1")
        process = dask("worker", scheduler, *options, "--no-dashboard")
        assert process.stderr is not None
        joined = 0
        for line in process.stderr:
            joined += "Registered to:" in line
            if joined == count:
                return
        raise AssertionError("no worker joined")

    return start


def test_results_of_a_cluster_are_those_of_one_process(
    scheduler: str, add_worker: Callable[..., None]
) -> None:
    add_worker(2)
    seeds = list(range(6))
    found = dict(compute(last_positions, seeds, scheduler))
    assert found == dict(compute(last_positions, seeds, 1))
    processes = {p for _, p in compute(process_id, seeds, scheduler)}
    assert os.getpid() not in processes


def test_cluster_that_cannot_compute_the_same_is_refused(
    scheduler: str, add_worker: Callable[..., None]
) -> None:
    with pytest.raises(ConfigurationError, match="scheduler"):
        list(compute(process_id, [0], scheduler))
    add_worker(1, threads=2)
    with pytest.raises(ConfigurationError, match="has 2 threads"):
        list(compute(process_id, [0], scheduler))


@pytest.mark.parametrize("address", ["tcp://127.0.0.1:9", "two"])
def test_scheduler_that_does_not_answer_is_named(
    address: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("stack.workers.CONNECTION_TIMEOUT", 0.5)
    with pytest.raises(ConfigurationError, match=f"workers '{address}': no Dask scheduler"):
        list(compute(process_id, [0], address))


def _runs(pid: int) -> bool:
    try:
        return "State:\tZ" not in Path(f"/proc/{pid}/status").read_text()
    except (FileNotFoundError, ProcessLookupError):
        return False


def _comes(condition: Callable[[], bool], timeout: float) -> bool:
    deadline = time.monotonic() + timeout
    while not condition() and time.monotonic() < deadline:
        time.sleep(0.1)
    return condition()


def test_workers_end_where_their_campaign_is_killed(tmp_path: Path) -> None:
    folder = tmp_path / "workers"
    folder.mkdir()
    script = tmp_path / "campaign.py"
    script.write_text(PROGRAM)
    running = subprocess.Popen(
        [sys.executable, str(script), str(folder)], env={**os.environ, "PYTHONPATH": ROOT}
    )
    try:
        assert _comes(lambda: len(list(folder.iterdir())) == 2, 60.0)
        workers = [int(file.name) for file in folder.iterdir()]
        assert all(map(_runs, workers))
    finally:
        running.kill()
        running.wait()
    assert _comes(lambda: not any(map(_runs, workers)), 20.0)
