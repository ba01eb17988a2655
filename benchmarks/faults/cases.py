"""Faults to inject, the stop causes that they must lead to, and their repair."""

from __future__ import annotations

import signal
import time
from collections.abc import Callable
from dataclasses import dataclass

from benchmarks.faults.cell import FaultCell
from benchmarks.faults.tcp_proxy import LineCommand, LineCondition
from stack.launcher.launcher import MAX_DEATHS

Action = Callable[[FaultCell], float | None]
"""Injection or repair of a fault; an injection may return the time of its effect [s]."""

SLOWED_CAUSES = (
    *("", "silence", "left_behind", "stalled", "lost_link", "tracking"),
    # The rope has fallen behind its path, and the controller waits for another one.
    "writer_holds",
)
"""Stop causes of a process that runs half of the time: it may still keep up."""
BOOT_TIMEOUT = 30.0
"""Time limit for a process to be ready again [s]."""
IMPATIENCE = 0.05
"""Time between two presses of Ctrl-C [s]."""
BLIND_TIME = 0.5
"""Time for which the controller continues without observing the rope [s]."""


@dataclass(frozen=True)
class FaultCase:
    """Fault in the middle of a motion."""

    description: str
    """Fault in words."""
    inject: Action
    """Injection of the fault."""
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
    promised: bool = True
    """Whether the arm must brake within the time limit."""
    keeps_up: bool = False
    """Whether the process may keep up, so that times of a stop count from its report."""


def _send(name: str, number: signal.Signals) -> Action:
    return lambda cell: cell.send_signal(name, number)


def _killed(
    name: str,
    *causes: str,
    effect: float = 0.0,
    silence: str = "hold",
    promised: bool = True,
) -> FaultCase:
    inject = _send(name, signal.SIGKILL)
    description = f"{name}: kill -9" + (
        f", the arm then: {silence}" if name == "robot_gateway" else ""
    )
    return FaultCase(
        description,
        inject,
        causes,
        effect=effect,
        restarted=(name,),
        silence=silence,
        promised=promised,
    )


def _killed_together(first: str, second: str, *causes: str) -> FaultCase:
    def kill(cell: FaultCell) -> None:
        for name in (first, second):
            cell.send_signal(name, signal.SIGKILL)

    description = f"{first} and {second}: kill -9 at once"
    return FaultCase(description, kill, causes, restarted=(first, second))


def _frozen(
    name: str,
    *causes: str,
    effect: float = 0.0,
    duration: float = 1.0,
    point_in_flight: bool = False,
    silence: str = "hold",
) -> FaultCase:
    return FaultCase(
        f"{name}: SIGSTOP" + (f", the arm then: {silence}" if name == "robot_gateway" else ""),
        _send(name, signal.SIGSTOP),
        causes,
        repair=_send(name, signal.SIGCONT),
        effect=effect,
        duration=duration,
        point_in_flight=point_in_flight,
        silence=silence,
    )


def _raised(name: str, *causes: str, effect: float = 0.0, promised: bool = True) -> FaultCase:
    return FaultCase(
        f"{name}: an exception at an arbitrary line",
        _send(name, signal.SIGUSR1),
        causes,
        effect=effect,
        restarted=(name,),
        promised=promised,
    )


def _interrupt_twice(cell: FaultCell) -> None:
    """Press Ctrl-C twice: the second time, every process is killed."""
    cell.send_signal("lariat", signal.SIGINT)
    time.sleep(IMPATIENCE)
    cell.send_signal("lariat", signal.SIGINT)


def _kill_until_given_up(cell: FaultCell) -> float:
    """Kill the planner whenever it is ready, until the launcher gives it up."""
    for _ in range(MAX_DEATHS):
        cell.wait_until(
            lambda: cell.process_state("planner") == "ready", BOOT_TIMEOUT, "no planner"
        )
        cell.send_signal("planner", signal.SIGKILL)
        cell.wait_until(
            lambda: cell.process_state("planner") != "ready", BOOT_TIMEOUT, "the planner lives on"
        )
    return cell.now()


def _slowed(name: str) -> FaultCase:
    return FaultCase(
        f"{name}: runs half of the time for 1 s, 20 ms on and 20 ms off",
        lambda cell: cell.slow_down(name, 1.0),
        SLOWED_CAUSES,
        keeps_up=True,
    )


def _line(
    condition: LineCondition, description: str, *causes: str, promised: bool = True
) -> FaultCase:
    return FaultCase(
        f"line: {description}",
        _command_line(condition),
        causes,
        repair=_command_line("normal"),
        promised=promised,
    )


def _command_line(command: LineCommand) -> Action:
    return lambda cell: cell.emulated.command_line(command)


CASES: dict[str, FaultCase] = {
    "controller-killed": _killed("controller", "silence", "new_writer"),
    "controller-frozen": _frozen("controller", "silence"),
    "perception-killed": _killed("perception", "writer_holds", effect=BLIND_TIME),
    "perception-frozen": _frozen("perception", "writer_holds", effect=BLIND_TIME),
    "planner-killed": _killed("planner"),
    "planner-frozen": _frozen("planner"),
    "sim-killed": _killed("sim", "writer_holds", effect=BLIND_TIME),
    "sim-frozen": _frozen("sim", "writer_holds", effect=BLIND_TIME),
    "recorder-killed": _killed("recorder"),
    "recorder-frozen": _frozen("recorder", duration=5.0),
    "dashboard-killed": _killed("dashboard"),
    "dashboard-frozen": _frozen("dashboard", duration=5.0),
    "hub-frozen": _frozen("lariat"),
    "gateway-frozen": _frozen("robot_gateway", "stalled", "alarm", "lost_link"),
    "gateway-frozen-coast": _frozen(
        "robot_gateway", "stalled", "alarm", "lost_link", silence="coast"
    ),
    "gateway-killed": _killed("robot_gateway", "boot"),
    "gateway-killed-coast": _killed("robot_gateway", "boot", silence="coast"),
    "gateway-killed-alarm": _killed("robot_gateway", "boot", silence="alarm"),
    "guard-killed": FaultCase(
        "the gateway's guard of the arm: kill -9",
        lambda cell: cell.send_signal("guard", signal.SIGKILL),
        (),
    ),
    "gateway-and-controller-killed": _killed_together("robot_gateway", "controller", "boot"),
    "gateway-and-planner-killed": _killed_together("robot_gateway", "planner", "boot"),
    "controller-and-perception-killed": _killed_together(
        "controller", "perception", "silence", "new_writer"
    ),
    "controller-raises": _raised("controller", "silence", "new_writer"),
    "gateway-raises": _raised("robot_gateway", "boot"),
    "perception-raises": _raised("perception", "writer_holds", effect=BLIND_TIME),
    "controller-slowed": _slowed("controller"),
    "gateway-slowed": _slowed("robot_gateway"),
    "arm-killed": FaultCase(
        "arm: its controller dies",
        lambda cell: cell.emulated.kill_emulator(),
        ("lost_link",),
        repair=lambda cell: cell.emulated.start_emulator(),
    ),
    "other-arm-killed": FaultCase(
        "the other arm: its controller dies",
        lambda cell: cell.emulated.kill_other_emulator(),
        ("lost_link",),
        repair=lambda cell: cell.emulated.start_other_emulator(),
        two_arms=True,
    ),
    "arm-frozen": _frozen("emulator", "lost_link", point_in_flight=True),
    "line-cut": FaultCase("line: every connection closed", _command_line("cut"), ("lost_link",)),
    "line-blocked": _line("blocked", "nothing passes", "lost_link"),
    "line-delayed": _line("delayed", "200 ms late, both ways", "lost_link", "tracking"),
    "line-fragmented": _line("fragmented", "in pieces of 1 to 300 bytes"),
    "line-corrupted": _line(
        "corrupted",
        "a wrong byte in a tenth of the arm's segments",
        *("", "lost_link", "tracking", "writer_holds"),
        promised=False,
    ),
    "hub-killed": FaultCase(
        "lariat up: kill -9, and with it the bus's hub",
        _send("lariat", signal.SIGKILL),
        ("boot",),
        repair=lambda cell: cell.start_stack(),
        stack_ends=True,
        duration=2.5,
    ),
    "interrupted-twice": FaultCase(
        "lariat up: Ctrl-C twice, which kills every process",
        _interrupt_twice,
        ("boot",),
        repair=lambda cell: cell.start_stack(),
        stack_ends=True,
        duration=2.5,
    ),
    "deaths-in-a-row": FaultCase(
        "planner: kill -9 three times, so that the launcher ends the stack",
        _kill_until_given_up,
        ("boot",),
        repair=lambda cell: cell.start_stack(),
        stack_ends=True,
        duration=4.0,
    ),
}
