"""Long operation of a live stack: `lariat bench speed endurance`."""

from __future__ import annotations

import logging
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import psutil

from benchmarks.child_processes import child_processes
from benchmarks.conditions import Conditions
from benchmarks.live_stack import LiveStack
from benchmarks.operator import RESET_TIMEOUT, Operator
from benchmarks.speed.live import latencies
from benchmarks.speed.pages import OpenPages
from benchmarks.tables import PRINT_DEFAULTS, Flat, PrintOptions, Result
from lariat.scenario import Scenario, find, load
from services.recorder.retention import IDLE_ENDING
from shared.recording import Recording
from shared.ros2.node import Node
from shared.ros2.router import environment_domain
from shared.ros2.table import Table

SAMPLE_PERIOD = 10.0
"""Time between two samples [s]."""
LATENCY_RECORDINGS = 5
"""Largest number of recordings that latencies are read from."""


@dataclass(frozen=True)
class Sample:
    """State of one process at one time."""

    process: str
    """Name of the process."""
    minutes: float
    """Time of operation so far [min]."""
    memory_mb: float
    """Resident memory [MB]."""
    files: int
    """Number of open files and sockets."""
    threads: int
    processor_s: float
    """Processor time that the process has used since it began [s]."""
    step_p99_ms: float = 0.0
    """99th percentile of the step times of the last second [ms]; 0 where there are no steps."""
    period_ms: float = 0.0
    """Period of the steps [ms]; 0 where there are no steps."""


def run(
    minutes: float = 30.0,
    pages: int = 20,
    ros2: bool = False,
    scenario: Path = Path("three-cylinders"),
    options: Flat[PrintOptions] = PRINT_DEFAULTS,
) -> int:
    """Run a live stack back to back, and show whether memory, files, threads or step times grow.

    `lariat up` with dashboard and recorder, pages open all the time, a reset after every run, as by
    a person who acknowledges its stops. Its recordings go to a temporary folder; the last of them
    tell how long camera images take to the arms.

    Examples:
      lariat bench speed endurance --minutes 480
      lariat bench speed endurance --minutes 2 --pages 0 --ros2

    Args:
        minutes: Time of operation [min].
        pages: Number of pages that are open during it.
        ros2: Whether it joins ROS 2's graph, where another node subscribes to all of its topics.
        scenario: A scenario's TOML file, or the short name of a shipped one.

    Returns:
        0 when every run reached its goal, 1 otherwise.
    """
    path = find(scenario)
    loaded = load(path)
    limit = loaded.run.time_limit + RESET_TIMEOUT
    samples: list[Sample] = []
    failures: list[str] = []
    runs, browsers = 0, None
    # What this process refuses beside the services is no news.
    logging.disable(logging.WARNING)
    with ExitStack() as cleanup:
        cleanup.callback(logging.disable, logging.NOTSET)
        stack = cleanup.enter_context(LiveStack(path, ros2=ros2))
        operator = Operator(cleanup.enter_context(stack.connect()))
        if pages:
            browsers = OpenPages(stack.address, pages)
            cleanup.callback(browsers.close)
        if ros2:
            cleanup.callback(_subscriber(stack.ros2_router, loaded).close)
        begun = sampled = time.monotonic()
        while (now := time.monotonic()) - begun < 60.0 * minutes:
            failure = operator.run_and_reset(limit)
            runs, failures = runs + (not failure), [*failures, *filter(None, [failure])]
            if now - sampled >= SAMPLE_PERIOD:
                sampled = now
                samples += _samples(stack.pid, operator, (now - begun) / 60.0)
                line = f"{samples[-1].minutes:.1f} min, {runs} runs reached"
                print(line, file=sys.stderr, flush=True)
        refused = sum(health.refused for health in operator.health.values())
        words = [f"{samples[-1].minutes if samples else 0.0:.1f} min, {runs} runs reached"]
        words += [str(Conditions.of(loaded.live))]
        words += [f"{len(operator.stops)} holds, {refused} messages refused", *operator.stops[:9]]
        if browsers and browsers.closed:
            words.append(f"{browsers.closed} pages ended {browsers.reason}".rstrip())
        files = sorted((stack.folder / "recordings").glob("*.mcap"))
        finished = [file for file in files if not file.name.endswith(IDLE_ENDING)]
        # The last one is still being written.
        newest = finished[:-1][-LATENCY_RECORDINGS:]
        delays = latencies(Recording.open(file) for file in newest)
    options.publish(
        Result("live", trends(samples), "; ".join([*words, *failures[:10]])),
        Result("latencies", delays, "from the exposure of an image"),
    )
    return 1 if failures else 0


def _subscriber(router: str, scenario: Scenario) -> Node:
    """Node of ROS 2 that subscribes to all topics of a cell's."""
    table = Table.of(scenario)
    node = Node("bench", table.settings.namespace, environment_domain(), router, serve=False)
    for source, output in table.sources:
        node.subscription(output.name_for(source.key), output.type, output.qos)
    return node


def _samples(launcher: int, operator: Operator, minutes: float) -> Iterator[Sample]:
    yield sample_of("lariat up", launcher, minutes)
    for name, health in sorted(operator.health.items()):
        with suppress(psutil.Error):  # It may just be restarted.
            steps = health.step_p99_ms, health.period_ms
            yield sample_of(name, health.process, minutes, *steps)
    stepping = {health.process for health in operator.health.values()}
    for pid, name in sorted(child_processes(launcher).items()):
        if pid not in stepping:
            with suppress(psutil.Error):
                yield sample_of(name, pid, minutes)


def sample_of(process: str, pid: int | None, minutes: float, *steps: float) -> Sample:
    """Return a sample of a running process; of this one where its id is None.

    Raises:
        psutil.NoSuchProcess: There is no such process.
    """
    running = psutil.Process(pid)
    times, memory = running.cpu_times(), running.memory_info().rss / 2**20
    used = times.user + times.system
    return Sample(process, minutes, memory, running.num_fds(), running.num_threads(), used, *steps)


def trends(samples: Sequence[Sample]) -> list[dict[str, object]]:
    """Return the change of each process, without its first tenth, which warms up.

    Step times are medians of the first and of the last half.
    """
    names = dict.fromkeys(sample.process for sample in samples)
    return [_trend([s for s in samples if s.process == name]) for name in names]


def _trend(samples: Sequence[Sample]) -> dict[str, object]:
    rows = samples[len(samples) // 10 :]
    first, last = rows[0], rows[-1]
    hours = np.array([row.minutes for row in rows]) / 60.0
    slope = np.polyfit(hours, [row.memory_mb for row in rows], 1)[0] if np.ptp(hours) > 0.0 else 0.0
    steps = [row.step_p99_ms for row in rows]
    half = max(len(rows) // 2, 1)
    seconds = 60.0 * (last.minutes - first.minutes)
    used = last.processor_s - first.processor_s
    return {
        "process": first.process,
        "samples": len(rows),
        "memory_mb": (round(first.memory_mb, 1), round(last.memory_mb, 1)),
        "memory_mb_per_hour": round(float(slope), 2),
        "files": (min(r.files for r in rows), max(r.files for r in rows)),
        "threads": (min(r.threads for r in rows), max(r.threads for r in rows)),
        "processor_percent": round(100.0 * used / seconds, 1) if seconds > 0.0 else 0.0,
        "step_p99_ms": [round(float(np.median(s)), 2) for s in (steps[:half], steps[-half:])],
        "period_ms": round(last.period_ms, 3),
    }
