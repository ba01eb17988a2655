"""Cell on two machines whose line is cut and healed on the way: `lariat bench faults machines`.

The machines are network namespaces of this one, joined by a cable; root alone may make them. Router
and gateway run on the first, some services on the second, all with the certificates of
`lariat certs`, as docs/guide/deployment.md describes.
"""

from __future__ import annotations

import contextlib
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.operator import DeadlineMissed, Operator
from benchmarks.tables import report
from lariat.configuration import ConfigurationError
from lariat.scenario.settings import load_with
from lariat.scenario.shipped import find
from shared import bus as buses
from shared.bus import BusOptions
from shared.messages import REACHED, ArmStates, TaskRequest
from stack import services
from stack.client import Cell, connect
from stack.credentials.access_control import OPERATOR, ROUTER
from stack.credentials.cell_credentials import SETTINGS_FILE, make_credentials
from stack.launcher import module_entry

ROBOT, VISION = "10.77.77.1", "10.77.77.2"
"""Addresses of the two machines."""
NAMESPACE = "lariat-vision"
"""Network namespace of the second machine."""
CABLE = ("lariat-cable-0", "lariat-cable-1")
"""Ends of the cable: on the first machine, and on the second."""
PORT = 7448
"""Port of the router."""
MOVING_SPEED = 0.02
"""Speed of a grip from which on the run is under way [m/s]."""
READY_TIMEOUT = 200.0
"""Longest wait for all services [s]; kernels may have to be compiled."""
TIMEOUT = 60.0
"""Longest wait for the arms to move, to hold, or to reach the goal [s]."""


@dataclass(frozen=True)
class MachinesOutcome:
    """One run with a cut."""

    remote: tuple[str, ...]
    """Services on the second machine."""
    rest_s: float
    """Time from the cut until the arms stood still."""
    moved_while_cut_mm: float
    """Way of a grip from then until the line was healed."""
    acknowledged: bool
    """Whether a person had to acknowledge the stop."""
    heard_again_s: float
    """Time from the healing until every service on the second machine was heard."""
    reached: bool
    """Whether the goal was reached afterwards."""
    error_mm: float
    """Mean node distance to the goal, as the controller sees it."""


def run(
    remote: tuple[str, ...] = ("perception", "planner"),
    scenario: str = "three-cylinders",
    sensing: str = "truth",
    duration: float = 4.0,
    json: bool = False,
) -> int:
    """Run a scenario on two machines, and cut their line in the middle of the motion.

    Examples:
      lariat bench faults machines
      lariat bench faults machines --remote controller planner

    Args:
        remote: Services on the second machine; router and gateway are on the first.
        scenario: Name of a shipped scenario.
        sensing: Source of the perceived rope: truth, or camera.
        duration: Duration of the cut [s].
        json: Print one JSON object instead of a table.

    Returns:
        0 if the arms stood still while the line was cut and the goal was reached, else 1.
    """
    with ExitStack() as stack, tempfile.TemporaryDirectory() as folder:
        stack.enter_context(cable())
        credentials = Path(folder)
        make_credentials(credentials, (ROBOT,), "cell", days=90)
        file = credentials / "scenario.toml"
        file.write_text(load_with(find(scenario), (f"sensing.source={sensing}",)).text)
        operator = stack.enter_context(_cell(credentials, file, remote))
        outcome = _run_with_cut(operator, remote, duration)
    report([outcome], json=json)
    return 0 if outcome.reached and outcome.moved_while_cut_mm < 1.0 else 1


@contextmanager
def cable() -> Iterator[None]:
    """Create the second machine and the cable to it, and remove them.

    Raises:
        ConfigurationError: Network namespaces are not allowed here.
    """
    here, there = CABLE
    try:
        _ip("netns", "add", NAMESPACE)
        _ip("link", "add", here, "type", "veth", "peer", "name", there, "netns", NAMESPACE)
        _ip("address", "add", f"{ROBOT}/30", "dev", here)
        _ip("-n", NAMESPACE, "address", "add", f"{VISION}/30", "dev", there)
        _ip("link", "set", here, "up")
        _ip("-n", NAMESPACE, "link", "set", there, "up")
    except (OSError, subprocess.SubprocessError) as error:
        _remove()
        raise ConfigurationError(f"network namespaces are not allowed here: {error}") from None
    try:
        yield
    finally:
        _remove()


def set_cable(connected: bool) -> None:
    """Plug the cable in, or pull it out."""
    _ip("link", "set", CABLE[0], "up" if connected else "down")


def on_second_machine(command: list[str]) -> list[str]:
    """Return a command that runs another one on the second machine."""
    return ["ip", "netns", "exec", NAMESPACE, *command]


def _ip(*arguments: str) -> None:
    subprocess.run(["ip", *arguments], check=True, capture_output=True, timeout=10)


def _remove() -> None:
    for arguments in (("link", "delete", CABLE[0]), ("netns", "delete", NAMESPACE)):
        with contextlib.suppress(OSError, subprocess.SubprocessError):
            _ip(*arguments)


@contextmanager
def _cell(credentials: Path, scenario: Path, remote: tuple[str, ...]) -> Iterator[Operator]:
    """Start router and services, and connect to them; ends them."""
    endpoint = f"tls/{ROBOT}:{PORT}"
    router = BusOptions("cell", (), (endpoint,), "router", credentials / ROUTER / SETTINGS_FILE)
    processes = []
    with ExitStack() as stack:
        stack.enter_context(buses.open(router, ROUTER))
        settings = credentials / OPERATOR / SETTINGS_FILE
        cell = Cell((endpoint,), "cell", "client", settings)
        operator = Operator(stack.enter_context(connect(cell)))
        try:
            for name in services.NAMES:
                command = [
                    sys.executable,
                    *module_entry.command(f"services.{name}", "--scenario", str(scenario)),
                    *("--mode", "client", "--connect", endpoint, "--listen"),
                    *("--settings", str(credentials / name / SETTINGS_FILE)),
                ]
                command = on_second_machine(command) if name in remote else command
                processes.append(subprocess.Popen(command))
            heard = lambda: operator.health.keys() >= set(services.NAMES)  # noqa: E731
            operator.wait_until(heard, READY_TIMEOUT, "not every service was heard")
            yield operator
        finally:
            for process in processes:
                process.terminate()
            for process in processes:
                process.wait()


def _run_with_cut(operator: Operator, remote: tuple[str, ...], duration: float) -> MachinesOutcome:
    operator.client.request_task(TaskRequest.START)
    operator.wait_until(
        lambda: _speed(operator.arms) > MOVING_SPEED, TIMEOUT, "the arms do not move", goes_on=True
    )
    set_cable(False)
    cut = time.monotonic()
    operator.wait_until(lambda: _speed(operator.arms) < 1e-4, TIMEOUT, "the arms do not rest")
    rest, stood = time.monotonic() - cut, _positions(operator.arms)
    time.sleep(max(cut + duration - time.monotonic(), 0.0))
    operator.update()
    moved = float(np.max(np.abs(_positions(operator.arms) - stood)))
    acknowledged = operator.arms.needs_acknowledgement
    operator.health.clear()
    set_cable(True)
    healed = time.monotonic()
    heard = lambda: operator.health.keys() >= set(remote)  # noqa: E731
    operator.wait_until(heard, TIMEOUT, "the second machine is not heard again")
    heard_after = time.monotonic() - healed
    with contextlib.suppress(DeadlineMissed):
        operator.wait_until(
            lambda: operator.task.state == REACHED, TIMEOUT, "not reached", goes_on=True
        )
    return MachinesOutcome(
        remote,
        round(rest, 3),
        round(1e3 * moved, 3),
        acknowledged,
        round(heard_after, 1),
        operator.task.state == REACHED,
        round(1e3 * operator.task.error, 3),
    )


def _speed(state: ArmStates) -> float:
    return max((float(np.linalg.norm(arm.linear_velocity)) for arm in state.arms), default=0.0)


def _positions(state: ArmStates) -> np.ndarray:
    return np.array([arm.position for arm in state.arms])
