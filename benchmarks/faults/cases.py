"""The faults that are injected, what they must lead to, and how the cell is made whole again."""

from __future__ import annotations

import signal
from collections.abc import Callable
from dataclasses import dataclass

from benchmarks.faults.cell import FaultCell

Act = Callable[[FaultCell], None]


@dataclass(frozen=True)
class Case:
    """One fault in the middle of a motion."""

    what: str
    inject: Act
    causes: tuple[str, ...]
    """Rows of docs/safety.md of which one must be named; empty: nothing may stop, which may also be
    one of them."""
    heal: Act | None = None
    """What a person repairs before looking at the arms."""
    effect: float = 0.0
    """From the fault until it has an effect that anybody could notice [s]."""
    lasts: float = 1.0
    """From the fault until it is healed [s]."""
    revives: tuple[str, ...] = ()
    """Processes that the launcher must have restarted before work can go on."""
    stack_ends: bool = False
    routed: bool = False
    """Whether the services meet through a router."""
    delivers: bool = False
    """Whether a servo point that was on its way reaches the arm after all."""
    silence: str = "hold"
    """What the arm does when servo points stop coming."""
    two_arms: bool = False
    """Whether it is the other arm's, while the right one is watched."""
    promised: bool = True
    """Whether software promises that the arm brakes in time."""


def _send(name: str, number: signal.Signals) -> Act:
    return lambda cell: cell.send(name, number)


def _killed(
    name: str, *causes: str, effect: float = 0.0, silence: str = "hold", promised: bool = True
) -> Case:
    act = _send(name, signal.SIGKILL)
    what = f"{name}: kill -9" + (f", the arm then: {silence}" if name == "robot_gateway" else "")
    return Case(
        what, act, causes, effect=effect, revives=(name,), silence=silence, promised=promised
    )


def _frozen(name: str, *causes: str, effect: float = 0.0, delivers: bool = False) -> Case:
    return Case(
        f"{name}: SIGSTOP for 1 s",
        _send(name, signal.SIGSTOP),
        causes,
        heal=_send(name, signal.SIGCONT),
        effect=effect,
        delivers=delivers,
    )


def _weather(name: str, what: str, *causes: str, promised: bool = True) -> Case:
    def become(weather: str) -> Act:
        return lambda cell: cell.weather(weather)

    return Case(f"line: {what}", become(name), causes, heal=become("fair"), promised=promised)


def _router_killed(cell: FaultCell) -> None:
    cell.send("router", signal.SIGKILL)
    cell.reap("router")


def _emulator_killed(cell: FaultCell) -> None:
    cell.send("emulator", signal.SIGKILL)
    assert cell.emulator is not None
    cell.emulator.wait()


def _other_emulator_killed(cell: FaultCell) -> None:
    assert cell.other_emulator is not None
    cell.other_emulator.kill()
    cell.other_emulator.wait()


BLIND = 0.5
"""For so long the controller goes on without seeing the rope [s]."""

CASES: dict[str, Case] = {
    "controller-killed": _killed("controller", "silence", "new_writer"),
    "controller-frozen": _frozen("controller", "silence"),
    "perception-killed": _killed("perception", "writer_holds", effect=BLIND),
    "perception-frozen": _frozen("perception", "writer_holds", effect=BLIND),
    "planner-killed": _killed("planner"),
    "hub-frozen": _frozen("lariat"),
    "gateway-frozen": _frozen("robot_gateway", "stalled", "lost_link"),
    "gateway-killed": _killed("robot_gateway", "boot"),
    "gateway-killed-coast": _killed("robot_gateway", "boot", silence="coast", promised=False),
    "gateway-killed-alarm": _killed("robot_gateway", "boot", silence="alarm", promised=False),
    "arm-killed": Case(
        "arm: its controller dies",
        _emulator_killed,
        ("lost_link",),
        heal=lambda cell: cell.start_emulator(),
    ),
    "other-arm-killed": Case(
        "the other arm: its controller dies",
        _other_emulator_killed,
        ("lost_link",),
        heal=lambda cell: cell.start_other_emulator(),
        two_arms=True,
    ),
    "arm-frozen": _frozen("emulator", "lost_link", delivers=True),
    "line-cut": Case(
        "line: every connection closed", lambda cell: cell.weather("cut"), ("lost_link",)
    ),
    "line-stuck": _weather("stuck", "nothing passes for 1 s", "lost_link"),
    "line-late": _weather("late", "200 ms late, both ways", "lost_link", "tracking"),
    "line-torn": _weather("torn", "in pieces of 1 to 300 bytes"),
    "line-spoiled": _weather(
        "spoiled",
        "a spoiled byte in a tenth of what the arm says",
        *("", "lost_link", "tracking", "writer_holds"),
        promised=False,
    ),
    "hub-killed": Case(
        "lariat up: kill -9, and with it the bus's hub",
        _send("lariat", signal.SIGKILL),
        ("boot",),
        heal=lambda cell: cell.start_stack(),
        stack_ends=True,
        lasts=2.5,
    ),
    "router-frozen": Case(
        "router: SIGSTOP for 1 s",
        _send("router", signal.SIGSTOP),
        ("silence",),
        heal=_send("router", signal.SIGCONT),
        routed=True,
    ),
    "router-killed": Case(
        "router: kill -9, started again after 1 s",
        _router_killed,
        ("silence",),
        heal=lambda cell: cell.start_router(),
        routed=True,
    ),
}
