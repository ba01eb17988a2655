"""Replay as your test: a recorded run holds every service to what it published.

`pytest examples/09_replay_as_your_test.py` runs it as a test. Keep a recording of your own cell
beside your tests, and a change of the code that changes a message fails.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
from matplotlib.figure import Figure
from rich.console import Console

from cli.replay import replay, traced_services
from lariat.scenario.settings import load_with
from shared.recording import Recording
from stack.replay.trace_replay import ReplayResult
from stack.simulation import closed_loop

SCENARIO = Path("three-cylinders")
"""Scenario of the run: a shipped one, or your file."""


def record(file: Path) -> None:
    """Record the first second of a run; a live stack records its runs by itself."""
    settings = ("sensing.source=truth", "run.time_limit=1.0")
    closed_loop.run(load_with(SCENARIO, settings), record=file)


def replayed(file: Path) -> list[ReplayResult]:
    """Step every service of a recording again."""
    recording = Recording.open(file)
    with tempfile.TemporaryDirectory() as folder:
        scenario = recording.scenario(Path(folder))
        names = traced_services(recording)
        return replay(recording, scenario, names, Console(file=sys.stderr))


def test_every_service_publishes_what_it_published(tmp_path: Path) -> None:
    record(tmp_path / "run.mcap")
    for result in replayed(tmp_path / "run.mcap"):
        assert result.differences == [], result.service


def main() -> Figure:
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "run.mcap"
        record(file)
        results = replayed(file)
    print(f"{sum(len(result.differences) for result in results)} differences")
    figure, axes = plt.subplots()
    axes.barh([r.service for r in results], [sum(r.compared.values()) for r in results])
    axes.set(xlabel="messages that are as recorded")
    figure.tight_layout()
    return figure


if __name__ == "__main__":
    main().savefig("09_replay_as_your_test.png")
