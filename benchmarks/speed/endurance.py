"""Long operation, simulated or live: `lariat bench speed endurance`."""

from __future__ import annotations

import logging
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import psutil

from benchmarks.child_processes import child_processes
from benchmarks.conditions import Conditions
from benchmarks.faults.hostile_publisher import drawn, publishing
from benchmarks.live_stack import LiveStack
from benchmarks.operator import RESET_TIMEOUT, Operator
from benchmarks.repeated_runs import RepeatedRuns
from benchmarks.speed.live import latencies
from benchmarks.speed.pages import OpenPages
from benchmarks.tables import PRINT_DEFAULTS, Flat, PrintOptions, Result
from lariat.scenario import Scenario, load
from lariat.scenario.shipped import find
from lariat.trajectory import SECOND
from services.recorder.retention import IDLE_ENDING
from shared.messages import REACHED
from shared.recording import Recording
from shared.ros2.node import Node
from shared.ros2.router import environment_domain
from shared.ros2.table import Table
from stack import services
from stack.simulation.simulated_time import START

DEFAULT_SCENARIO = find("three-cylinders")
"""Scenario of the runs."""
SIMULATED_SAMPLE_PERIOD = 30 * SECOND
"""Simulated time between two samples [ns]."""
SAMPLE_PERIOD = 10.0
"""Time between two samples of a live stack [s]."""
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


@dataclass
class Operation:
    """Runs back to back."""

    samples: list[Sample] = field(default_factory=list)
    """Samples of all processes."""
    runs: int = 0
    """Number of runs that reached their goal."""
    failures: list[str] = field(default_factory=list)
    """Runs that did not, in words."""
    notes: list[str] = field(default_factory=list)
    """What else there is to say."""
    latency: list[dict[str, object]] = field(default_factory=list)
    """Latencies from camera to arm."""

    def add(self, samples: list[Sample]) -> None:
        """Add samples of one time, and print a line."""
        self.samples += samples
        newest = samples[-1]
        line = f"{newest.minutes:.1f} min, {self.runs} runs reached, {newest.memory_mb:.0f} MB"
        print(line, file=sys.stderr, flush=True)


def run(
    hours: float = 1.0,
    live_minutes: float = 0.0,
    pages: int = 20,
    hostile_rate: float = 0.0,
    ros2: bool = False,
    scenario: Path = DEFAULT_SCENARIO,
    options: Flat[PrintOptions] = PRINT_DEFAULTS,
) -> int:
    """Run back to back for hours, and show whether memory, files, threads or step times grow.

    Simulated: all services in one process, true nodes sensed, a reset after every run. Live:
    `lariat up` with dashboard and recorder, pages open all the time. Its recordings go to a
    temporary folder; the last of them tell how long camera images take to the arms.

    Examples:
      lariat bench speed endurance --hours 8
      lariat bench speed endurance --hours 0 --live-minutes 30 --pages 20
      lariat bench speed endurance --hours 0 --live-minutes 5 --pages 0 --hostile-rate 1000
      lariat bench speed endurance --hours 0 --live-minutes 2 --pages 0 --ros2

    Args:
        hours: Simulated time of operation [h]; 0 for a live one.
        live_minutes: Time of live operation [min].
        pages: Number of pages that are open during it.
        hostile_rate: Hostile messages over all topics in a second of it, which the check of the bus
            refuses [Hz].
        ros2: Whether it joins ROS 2's graph, where another node subscribes to all of its topics.
        scenario: Scenario of the runs.

    Returns:
        0 when every run reached its goal, 1 otherwise.
    """
    loaded = load(scenario)
    operations: list[tuple[str, Operation, str]] = []
    # What this process refuses beside the services is no news.
    logging.disable(logging.WARNING)
    if hours > 0.0:
        done = simulated(loaded, 60.0 * hours)
        operations.append(("simulated", done, "true nodes sensed"))
    if live_minutes > 0.0:
        done = live(scenario, live_minutes, pages, hostile_rate, ros2)
        operations.append(("live", done, str(Conditions.of(loaded.live))))
    logging.disable(logging.NOTSET)
    tables = []
    for name, done, conditions in operations:
        minutes = max((sample.minutes for sample in done.samples), default=0.0)
        words = [f"{minutes:.1f} min, {done.runs} runs reached", conditions]
        words += [*done.notes[:10], *done.failures[:10]]
        tables.append(Result(name, trends(done.samples), "; ".join(words)))
        if done.latency:
            tables.append(Result("latencies", done.latency, "from the exposure of an image"))
    options.publish(*tables)
    return 1 if any(done.failures for _, done, _ in operations) else 0


def simulated(scenario: Scenario, minutes: float) -> Operation:
    """Run back to back in one process in simulated time, with true nodes in place of the camera."""
    sensing = replace(scenario.sensing, source="truth")
    cell = RepeatedRuns(replace(scenario, sensing=sensing))
    operation, sampled = Operation(), cell.stack.now
    while (now := (cell.stack.now - START) / (60 * SECOND)) < minutes:
        task = cell.run()
        if task.state == REACHED:
            operation.runs += 1
        else:
            operation.failures.append(f"{now:.1f} min: {task.reason or 'time limit passed'}")
        cell.reset()
        if cell.stack.now - sampled >= SIMULATED_SAMPLE_PERIOD:
            sampled = cell.stack.now
            operation.add(list(_simulated_samples(cell, now)))
    return operation


def _simulated_samples(cell: RepeatedRuns, minutes: float) -> Iterator[Sample]:
    """Yield a sample of this process for each service, whose step times they hold."""
    for name in services.NAMES:
        times = cell.stack.step_ms(name)
        yield sample_of(name, None, minutes, float(np.percentile(times, 99)))
        times.clear()


def live(
    scenario: Path, minutes: float, pages: int, hostile_rate: float = 0.0, ros2: bool = False
) -> Operation:
    """Run back to back in `lariat up`, as a person who acknowledges its stops."""
    loaded = load(scenario)
    operation, limit = Operation(), loaded.run.time_limit + RESET_TIMEOUT
    with ExitStack() as cleanup:
        stack = cleanup.enter_context(LiveStack(scenario, ros2=ros2))
        operator = Operator(cleanup.enter_context(stack.connect()))
        browsers = OpenPages(stack.address, pages) if pages else None
        if browsers:
            cleanup.callback(browsers.close)
        if hostile_rate:
            flood = publishing(drawn(valid=False), stack.hub, stack.namespace, hostile_rate)
            cleanup.enter_context(flood)
        if ros2:
            cleanup.callback(_subscriber(stack.ros2_router, loaded).close)
        begun = sampled = time.monotonic()
        while (now := time.monotonic()) - begun < 60.0 * minutes:
            if failure := operator.run_and_reset(limit):
                operation.failures.append(failure)
            else:
                operation.runs += 1
            if now - sampled >= SAMPLE_PERIOD:
                sampled = now
                operation.add(list(_live_samples(stack.pid, operator, (now - begun) / 60.0)))
        refused = sum(health.refused for health in operator.health.values())
        operation.notes += [f"{len(operator.stops)} holds, {refused} messages refused"]
        operation.notes += operator.stops
        if browsers and browsers.closed:
            operation.notes.append(f"{browsers.closed} pages ended {browsers.reason}".rstrip())
        files = sorted((stack.folder / "recordings").glob("*.mcap"))
        runs = [path for path in files if not path.name.endswith(IDLE_ENDING)]
        # The last one is still being written.
        newest = runs[:-1][-LATENCY_RECORDINGS:]
        operation.latency = latencies(Recording.open(path) for path in newest)
    return operation


def _subscriber(router: str, scenario: Scenario) -> Node:
    """Node of ROS 2 that subscribes to all topics of a cell's."""
    table = Table.of(scenario)
    node = Node("bench", table.settings.namespace, environment_domain(), router, serve=False)
    for output in table.outputs:
        for source in table.sources(output.source):
            node.subscription(output.name_for(source.key), output.type, output.qos)
    return node


def _live_samples(launcher: int, operator: Operator, minutes: float) -> Iterator[Sample]:
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
