"""Guard of an arm as a process: it stops the arm whose gateway has died or hangs."""

from __future__ import annotations

import os
import signal
import socket
import time
from collections.abc import Iterator

import pytest

from services.robot_gateway.drivers.cr5.tcp_link import TcpLink
from services.robot_gateway.stop_guard.guard_process import REPORT_TIMEOUT
from services.robot_gateway.stop_guard.stop_guard import StopGuard
from tests.shared.cell import until

COMMANDS = ("ResetRobot()", "DisableRobot()")
PERIOD = 0.008


@pytest.fixture
def server() -> Iterator[socket.socket]:
    with socket.create_server(("127.0.0.1", 0)) as listening:
        listening.settimeout(5.0)
        yield listening


@pytest.fixture
def guard() -> Iterator[StopGuard]:
    made = StopGuard()
    yield made
    made.close()


def connected(server: socket.socket) -> tuple[socket.socket, socket.socket]:
    own = socket.create_connection(server.getsockname())
    arm, _ = server.accept()
    arm.settimeout(3.0)
    return own, arm


def report(
    guard: StopGuard, connection: socket.socket | None, moving: bool, ticks: int = 5
) -> None:
    for _ in range(ticks):
        guard.report(connection, COMMANDS, moving)
        time.sleep(PERIOD)


def nothing_comes(arm: socket.socket, seconds: float) -> bool:
    arm.settimeout(seconds)
    try:
        arm.recv(100)
    except TimeoutError:
        return True
    return False


def test_arm_is_stopped_and_loses_its_power_when_the_gateway_dies(server: socket.socket) -> None:
    own, arm = connected(server)
    gateway = os.fork()
    if gateway == 0:
        guard = StopGuard()
        while True:
            report(guard, own, moving=False)
    own.close()
    # The guard holds the connection from the first report on.
    time.sleep(0.2)
    os.kill(gateway, signal.SIGKILL)
    os.waitpid(gateway, 0)
    assert arm.recv(100) == b"ResetRobot()"
    assert arm.recv(100) == b"DisableRobot()"
    arm.sendall(b"0,{},ResetRobot();0,{},DisableRobot();")
    assert arm.recv(100) == b"", "the next gateway finds the port free"


def test_moving_arm_is_stopped_once_when_reports_cease(
    server: socket.socket, guard: StopGuard
) -> None:
    own, arm = connected(server)
    report(guard, own, moving=True)
    ceased = time.monotonic()
    assert arm.recv(100) == b"ResetRobot()"
    assert time.monotonic() - ceased > 0.5 * REPORT_TIMEOUT
    assert nothing_comes(arm, 2.5 * REPORT_TIMEOUT)
    # The gateway goes on, moves the arm again, and hangs again.
    report(guard, own, moving=True)
    arm.settimeout(3.0)
    assert arm.recv(100) == b"ResetRobot()"


def test_arm_at_rest_is_left_alone_when_reports_cease(
    server: socket.socket, guard: StopGuard
) -> None:
    own, arm = connected(server)
    report(guard, own, moving=True)
    report(guard, own, moving=False)
    assert nothing_comes(arm, 2.5 * REPORT_TIMEOUT)


def test_former_connection_is_not_used_again(server: socket.socket, guard: StopGuard) -> None:
    own, arm = connected(server)
    report(guard, own, moving=True)
    report(guard, None, moving=True)
    own.close()
    assert arm.recv(100) == b""
    own, arm = connected(server)
    report(guard, own, moving=True)
    assert arm.recv(100) == b"ResetRobot()"


def test_orderly_end_sends_nothing(server: socket.socket) -> None:
    own, arm = connected(server)
    guard = StopGuard()
    report(guard, own, moving=True)
    guard.close()
    assert guard.pid == 0
    assert nothing_comes(arm, 2.5 * REPORT_TIMEOUT)


def test_guard_that_has_died_is_replaced_and_gets_the_connection(
    server: socket.socket, guard: StopGuard
) -> None:
    own, arm = connected(server)
    report(guard, own, moving=False)
    first = guard.pid
    os.kill(first, signal.SIGKILL)

    def replaced() -> bool:
        report(guard, own, moving=True, ticks=1)
        return guard.pid not in (0, first)

    until(replaced)
    report(guard, own, moving=True)
    assert arm.recv(100) == b"ResetRobot()"


def test_aborted_stream_is_reset_though_the_guard_holds_a_copy(server: socket.socket) -> None:
    link = TcpLink("127.0.0.1")
    link.advance(time.monotonic_ns())
    stream = link.open(server.getsockname()[1])
    arm, _ = server.accept()
    arm.settimeout(2.0)
    assert stream.state == "open"
    for _ in range(5):
        link.guard(stream, COMMANDS, False)
        time.sleep(PERIOD)
    stream.abort()
    with pytest.raises(ConnectionResetError):
        arm.recv(100)
    link.close()
