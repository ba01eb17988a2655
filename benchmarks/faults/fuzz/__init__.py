"""Hostile messages, files, pages and arms for every process: `lariat bench faults fuzz`."""

from __future__ import annotations

import json as encoder
import logging
import resource
import sys
import tempfile
from dataclasses import asdict
from pathlib import Path
from typing import Protocol

from benchmarks.faults.fuzz import message_targets
from benchmarks.faults.fuzz.arm_targets import ClientTarget, EmulatorTarget
from benchmarks.faults.fuzz.bus_target import BusTarget
from benchmarks.faults.fuzz.dashboard_target import DashboardTarget
from benchmarks.faults.fuzz.file_targets import file_targets
from benchmarks.faults.fuzz.launcher_target import LauncherTarget
from benchmarks.faults.fuzz.message_targets import ServiceTarget, Totals
from benchmarks.faults.fuzz.page_target import PageTarget
from lariat.configuration import ConfigurationError
from lariat.scenario import Scenario, load
from lariat.scenario.shipped import find
from lariat.trajectory import SECOND
from stack import services
from stack.simulation.simulated_time import START, Delivery, SimulatedStack

BATCH_SIZE = 256
"""Messages or files of a batch, which has a seed of its own."""
DEFAULT_SCENARIO = find("three-cylinders")
"""Scenario of the services."""
LAWFUL_TIME = SECOND
"""Simulated time of the ordinary run whose messages are mutated [ns]."""
FILE_TARGETS = ("scenario", "nodes", "recording", "png", "jpeg", "stl", "obj")
"""Kinds of files."""
PORT_TARGETS = ("bus", "page", "cr5-client", "cr5-emulator")
"""Ends of connections: doors of a real bus, the page, the gateway's client of an arm, the arm."""
MESSAGE_TARGETS = (*message_targets.NAMES, "dashboard", "launcher")
"""Processes that read the bus."""
TARGETS = (*MESSAGE_TARGETS, *PORT_TARGETS, *FILE_TARGETS)
"""Names of all targets."""


class Target(Protocol):
    """What is attacked."""

    def run_batch(self, seed: str, count: int, totals: Totals) -> None:
        """Attack it a number of times."""
        ...

    def close(self) -> None:
        """Release what it holds."""
        ...


def run(
    targets: tuple[str, ...] = TARGETS,
    count: int = 10_000,
    seed: int = 0,
    scenario: Path = DEFAULT_SCENARIO,
    progress: Path | None = None,
    json: bool = False,
) -> int:
    """Send hostile messages to every process, hostile bytes to every port, files to every reader.

    Messages: random bytes, mutated valid ones, wrong lengths, numbers that are none, extremes of
    integers, unknown enum values, other types, made-up publishers and numbers. They pass the check
    of the bus, and what it lets through reaches the service among the messages of an ordinary run.
    A failure is an exception, a body that vanishes from the gateway's scene, or an arm that moves.
    `bus`, `page` and `dashboard` need free ports of 127.0.0.1; the arm is an emulator in this
    process.

    Examples:
      lariat bench faults fuzz --count 2000
      lariat bench faults fuzz --count 1000000 --progress fuzz.json

    Args:
        targets: Processes, ports and kinds of files.
        count: Messages or files for each target.
        seed: Seed of all choices.
        scenario: Scenario of the services.
        progress: File of the totals so far; an interrupted campaign goes on from it.
        json: Print one JSON object instead of a table.

    Returns:
        0 when nothing failed, 1 otherwise.
    """
    for name in targets:
        if name not in TARGETS:
            raise ConfigurationError(f"no target {name!r}; expected one of {', '.join(TARGETS)}")
    totals = _read(progress, seed)
    # Refusals are what is asked for, not news.
    logging.disable(logging.ERROR)
    with tempfile.TemporaryDirectory() as folder:
        cell = load(scenario)
        lawful = ordinary_run(cell) if set(targets) & set(MESSAGE_TARGETS) else []
        for name in targets:
            target = _target(name, cell, lawful, Path(folder))
            mine = totals.setdefault(name, Totals())
            while mine.messages < count:
                batch = min(BATCH_SIZE, count - mine.messages)
                target.run_batch(f"{seed}/{name}/{mine.messages}", batch, mine)
                mine.memory_mb = max(mine.memory_mb, _memory())
                _write(progress, seed, totals)
                _report(name, mine, count)
            target.close()
    logging.disable(logging.NOTSET)
    if json:
        rows = {name: asdict(totals[name]) for name in targets}
        print(encoder.dumps({"seed": seed, "targets": rows}))
    else:
        _print({name: totals[name] for name in targets})
    return 1 if any(totals[name].failures for name in targets) else 0


def ordinary_run(scenario: Scenario) -> list[Delivery]:
    """Return the messages of an ordinary run in simulated time."""
    deliveries: list[Delivery] = []
    members = [services.build(name, scenario, f"{name}-0") for name in services.NAMES]
    stack = SimulatedStack(members, [deliveries.append])
    stack.warm_up()
    stack.advance_to(START + LAWFUL_TIME)
    return deliveries


def _target(name: str, cell: Scenario, lawful: list[Delivery], folder: Path) -> Target:
    match name:
        case "dashboard":
            return DashboardTarget(cell, lawful)
        case "launcher":
            return LauncherTarget(lawful)
        case "bus":
            return BusTarget()
        case "page":
            return PageTarget(cell)
        case "cr5-client":
            return ClientTarget()
        case "cr5-emulator":
            return EmulatorTarget()
    if name in message_targets.NAMES:
        return ServiceTarget(name, cell, lawful)
    return file_targets(cell, folder)[name]


def _read(progress: Path | None, seed: int) -> dict[str, Totals]:
    if progress is None or not progress.exists():
        return {}
    try:
        known = encoder.loads(progress.read_text(encoding="utf-8"))
        if known["seed"] != seed:
            raise ConfigurationError(
                f"{progress} has seed {known['seed']}; give --seed or a new file"
            )
        return {name: Totals(**row) for name, row in known["targets"].items()}
    except (OSError, KeyError, TypeError, encoder.JSONDecodeError) as error:
        raise ConfigurationError(f"cannot read {progress}: {error}; remove it") from error


def _write(progress: Path | None, seed: int, totals: dict[str, Totals]) -> None:
    if progress is None:
        return
    rows = {name: asdict(each) for name, each in totals.items()}
    # Replaced as a whole: a campaign may be interrupted at any time.
    new = progress.with_suffix(".new")
    new.write_text(encoder.dumps({"seed": seed, "targets": rows}), encoding="utf-8")
    new.replace(progress)


def _report(name: str, totals: Totals, count: int) -> None:
    end = "\n" if totals.messages >= count else "\r"
    found = f"{len(totals.failures)} failures, {totals.memory_mb:.0f} MB"
    line = f"{name}: {totals.messages} of {count}, {found}"
    print(line, end=end, file=sys.stderr, flush=True)


def _memory() -> float:
    """Memory of this process [MB]."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return round(pages * resource.getpagesize() / 2**20, 1)


def _print(totals: dict[str, Totals]) -> None:
    from rich.console import Console
    from rich.table import Table

    console = Console(file=sys.stdout, width=160)
    table = Table(box=None, pad_edge=False)
    for head in ("target", "hostile", "accepted", "steps", "memory MB", "failures"):
        table.add_column(head, justify="left" if head == "target" else "right")
    for name, row in totals.items():
        numbers = (row.messages, row.accepted, row.steps, round(row.memory_mb), len(row.failures))
        table.add_row(name, *map(str, numbers))
    console.print(table)
    for row in totals.values():
        for failure in row.failures[:5]:
            console.print(failure, markup=False)
