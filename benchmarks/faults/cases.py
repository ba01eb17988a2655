"""Faults to inject, the stop causes that they must lead to, and their repair."""

from __future__ import annotations

import signal
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from benchmarks.faults.arms import OTHER_SIDE
from benchmarks.faults.cell import FaultCell, RoutedCell
from benchmarks.faults.tcp_proxy import LineCommand, LineCondition
from stack.launcher.launcher import MAX_DEATHS

Action = Callable[[FaultCell], float | None]
"""Injection or repair of a fault; an injection may return the time of its effect [s]."""

BOOT_TIMEOUT = 30.0
"""Time limit for a process to be ready again [s]."""
IMPATIENCE = 0.05
"""Time between two presses of Ctrl-C [s]."""
BLIND_TIME = 0.5
"""Time for which the controller continues without observing the rope [s]."""


@dataclass(frozen=True)
class FaultCase:
    """Fault in the middle of a motion."""

    inject: Action
    causes: tuple[str, ...]
    """Stop causes of which the gateway must report one; empty, or one that is empty: no stop."""
    repair: Action | None = None
    """Repair of the fault, before the operator acknowledges."""
    effect: float = 0.0
    """Time from the fault until it has a noticeable effect [s]."""
    duration: float = 1.0
    """Time from the effect until the repair [s]."""
    restarted: tuple[str, ...] = ()
    """Processes that the launcher must restart before the run continues."""
    stack_ends: bool = False
    """Whether the whole stack ends."""
    point_in_flight: bool = False
    """Whether a servo point in flight still reaches the arm."""
    silence: str = "hold"
    """Reaction of the arm when servo points stop."""
    two_arms: bool = False
    """Whether the fault is that of the other arm."""
    routed: bool = False
    """Whether every process is a client of a router."""
    promised: bool = True
    """Whether the arm must brake within the time limit."""
    keeps_up: bool = False
    """Whether the process may keep up, so that times of a stop count from its report."""


def _send(name: str, number: signal.Signals) -> Action:
    return lambda cell: cell.send_signal(name, number)


def _killed(*names: str, causes: tuple[str, ...] = (), **more: Any) -> FaultCase:
    """Kill processes at once, which the launcher starts again."""

    def kill(cell: FaultCell) -> None:
        for name in names:
            cell.send_signal(name, signal.SIGKILL)

    return FaultCase(kill, causes, restarted=names, **more)


def _frozen(name: str, *causes: str, **more: Any) -> FaultCase:
    thaw = _send(name, signal.SIGCONT)
    return FaultCase(_send(name, signal.SIGSTOP), causes, repair=thaw, **more)


def _raised(name: str, *causes: str, **more: Any) -> FaultCase:
    """Raise an exception at an arbitrary line."""
    return FaultCase(_send(name, signal.SIGUSR1), causes, restarted=(name,), **more)


def _slowed(name: str) -> FaultCase:
    """Let a process run half of the time for 1 s: it may still keep up.

    The writer holds where the rope has fallen behind its path, and the controller waits for another
    one.
    """
    causes = ("silence", "left_behind", "stalled", "lost_link", "tracking", "writer_holds")
    return FaultCase(lambda cell: cell.slow_down(name, 1.0), ("", *causes), keeps_up=True)


def _line(condition: LineCondition, *causes: str, **more: Any) -> FaultCase:
    return FaultCase(_command_line(condition), causes, repair=_command_line("normal"), **more)


def _command_line(command: LineCommand) -> Action:
    return lambda cell: cell.emulated.command_line(command)


def _ended(inject: Action, duration: float = 2.5) -> FaultCase:
    """End the whole stack, and start it again."""
    again: Action = lambda cell: cell.start_stack()  # noqa: E731
    return FaultCase(inject, ("boot",), repair=again, stack_ends=True, duration=duration)


def _kill_router(cell: FaultCell) -> None:
    assert isinstance(cell, RoutedCell)
    cell.kill_router()


def _start_router(cell: FaultCell) -> None:
    assert isinstance(cell, RoutedCell)
    cell.start_router()
    cell.await_all()


def _interrupt_twice(cell: FaultCell) -> None:
    """Press Ctrl-C twice: the second time, every process is killed."""
    cell.send_signal("lariat", signal.SIGINT)
    time.sleep(IMPATIENCE)
    cell.send_signal("lariat", signal.SIGINT)


def _kill_until_given_up(cell: FaultCell) -> float:
    """Kill the planner whenever it is ready, until the launcher gives it up."""
    is_ready = lambda: cell.process_state("planner") == "ready"  # noqa: E731
    for _ in range(MAX_DEATHS):
        cell.wait_until(is_ready, BOOT_TIMEOUT, "no planner")
        cell.send_signal("planner", signal.SIGKILL)
        cell.wait_until(lambda: not is_ready(), BOOT_TIMEOUT, "the planner lives on")
    return cell.now()


_BLIND = {"causes": ("writer_holds",), "effect": BLIND_TIME}
_SILENT = {"causes": ("silence", "new_writer")}
_SUSPENDED = ("stalled", "alarm", "lost_link")

CASES: dict[str, FaultCase] = {
    "controller-killed": _killed("controller", **_SILENT),
    "controller-frozen": _frozen("controller", "silence"),
    "perception-killed": _killed("perception", **_BLIND),
    "perception-frozen": _frozen("perception", "writer_holds", effect=BLIND_TIME),
    "planner-killed": _killed("planner"),
    "planner-frozen": _frozen("planner"),
    "sim-killed": _killed("sim", **_BLIND),
    "sim-frozen": _frozen("sim", "writer_holds", effect=BLIND_TIME),
    "recorder-killed": _killed("recorder"),
    "recorder-frozen": _frozen("recorder", duration=5.0),
    "dashboard-killed": _killed("dashboard"),
    "dashboard-frozen": _frozen("dashboard", duration=5.0),
    "hub-frozen": _frozen("lariat"),
    "gateway-frozen": _frozen("robot_gateway", *_SUSPENDED),
    "gateway-frozen-coast": _frozen("robot_gateway", *_SUSPENDED, silence="coast"),
    "gateway-killed": _killed("robot_gateway", causes=("boot",)),
    "gateway-killed-coast": _killed("robot_gateway", causes=("boot",), silence="coast"),
    "gateway-killed-alarm": _killed("robot_gateway", causes=("boot",), silence="alarm"),
    "guard-killed": FaultCase(_send("guard", signal.SIGKILL), ()),
    "gateway-and-controller-killed": _killed("robot_gateway", "controller", causes=("boot",)),
    "gateway-and-planner-killed": _killed("robot_gateway", "planner", causes=("boot",)),
    "controller-and-perception-killed": _killed("controller", "perception", **_SILENT),
    "controller-raises": _raised("controller", *_SILENT["causes"]),
    "gateway-raises": _raised("robot_gateway", "boot"),
    "perception-raises": _raised("perception", "writer_holds", effect=BLIND_TIME),
    "controller-slowed": _slowed("controller"),
    "gateway-slowed": _slowed("robot_gateway"),
    "arm-killed": FaultCase(
        lambda cell: cell.emulated.kill(),
        ("lost_link",),
        repair=lambda cell: cell.emulated.start(),
    ),
    "other-arm-killed": FaultCase(
        lambda cell: cell.emulated.kill(OTHER_SIDE),
        ("lost_link",),
        repair=lambda cell: cell.emulated.start(OTHER_SIDE),
        two_arms=True,
    ),
    "arm-frozen": _frozen("emulator", "lost_link", point_in_flight=True),
    "line-cut": FaultCase(_command_line("cut"), ("lost_link",)),
    "line-blocked": _line("blocked", "lost_link"),
    "line-delayed": _line("delayed", "lost_link", "tracking"),
    "line-fragmented": _line("fragmented"),
    "line-corrupted": _line(
        "corrupted", "", "lost_link", "tracking", "writer_holds", promised=False
    ),
    "hub-killed": _ended(_send("lariat", signal.SIGKILL)),
    "interrupted-twice": _ended(_interrupt_twice),
    "deaths-in-a-row": _ended(_kill_until_given_up, 4.0),
    "router-killed": FaultCase(
        _kill_router, ("silence",), repair=_start_router, duration=4.0, routed=True
    ),
}
