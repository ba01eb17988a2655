"""The programs of a live stack: command line, priority and shutdown stage of each process."""

from __future__ import annotations

import signal
from collections.abc import Mapping, Sequence
from pathlib import Path

from lariat.scenario import SIDES, Scenario, Side
from lariat.scenario.sections import End
from stack.launcher.process import Program

EMULATOR_HOSTS: dict[Side, str] = {"left": "127.0.0.31", "right": "127.0.0.32"}
"""Loopback address of the emulated arm at each end: the protocol's ports are fixed."""
EMULATOR_PORTS = (29999, 30003, 30004)
"""Ports on which the gateway talks to an arm."""
NICENESS = {
    "robot_gateway": -15,
    "controller": -10,
    "sim": -5,
    "perception": -5,
    "planner": 5,
    "dashboard": 5,
    "recorder": -3,
}
"""Scheduling priority of each service; values below 0 only hold where the system allows it."""
LAST_STAGE = 2
"""Stage at which the recorder and the emulated arms are ended."""
SHUTDOWN_STAGES = {"robot_gateway": 1, "recorder": LAST_STAGE}
"""The gateway ends after all that talk to it, the recorder after all that it records."""


def emulated_sides(scenario: Scenario) -> list[Side]:
    """Return the ends whose arm is a CR5 without an address, which the emulator plays."""
    sides: tuple[Side, ...] = SIDES
    return [side for side in sides if _is_emulated(scenario.end(side))]


def _is_emulated(end: End) -> bool:
    return end.driver == "cr5" and not end.address


def service_program(
    name: str,
    common: Sequence[str],
    emulated: Sequence[Side],
    options: Mapping[str, Sequence[str]],
) -> Program:
    """Program of a service or of the dashboard, with options of its own by its name."""
    more = tuple(options.get(name, ()))
    if name == "robot_gateway":
        more = tuple(a for s in emulated for a in (f"--{s}-emulator", EMULATOR_HOSTS[s]))
    return Program(
        name,
        "dashboard" if name == "dashboard" else f"services.{name}",
        (*common, *more),
        restart_arguments=("--restarted",),
        stage=SHUTDOWN_STAGES.get(name, 0),
        niceness=NICENESS.get(name, 0),
        saves=name in ("recorder", "dashboard"),
        # These two shut down in an orderly way even when the launcher is killed.
        death_signal=signal.SIGTERM if name in ("robot_gateway", "recorder") else signal.SIGKILL,
    )


def emulator_program(side: Side, scenario: Path) -> Program:
    """Program of the emulator that plays the arm of one end."""
    host = EMULATOR_HOSTS[side]
    file = str(scenario.resolve())
    return Program(
        f"cr5-{side}",
        "services.cr5_emulator",
        ("--host", host, "--scenario", file, "--side", side),
        stage=LAST_STAGE,
        niceness=NICENESS["robot_gateway"],
        ready_line="ready",
    )
