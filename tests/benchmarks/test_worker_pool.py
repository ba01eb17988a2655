"""Processes of a campaign end with the one that began it."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

from benchmarks import worker_pool

PROGRAM = """
import sys
from benchmarks import worker_pool
from tests.benchmarks.test_worker_pool import wait
if __name__ == "__main__":
    for _ in worker_pool.compute(wait, [sys.argv[1]] * 2, 2):
        pass
"""


def wait(folder: str) -> None:
    """Name this process in a folder and compute for a minute."""
    Path(folder, str(os.getpid())).touch()
    time.sleep(60.0)


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
    root = str(Path(worker_pool.__file__).parents[1])
    campaign = subprocess.Popen(
        [sys.executable, str(script), str(folder)], env={**os.environ, "PYTHONPATH": root}
    )
    try:
        assert _comes(lambda: len(list(folder.iterdir())) == 2, 60.0)
        workers = [int(file.name) for file in folder.iterdir()]
        assert all(map(_runs, workers))
    finally:
        campaign.kill()
        campaign.wait()
    assert _comes(lambda: not any(map(_runs, workers)), 20.0)
