"""The emulated arm as a process on its real ports."""

from __future__ import annotations

import contextlib
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest

from services.cr5_emulator.options import EmulatorOptions
from services.robot_gateway.drivers.cr5.client import Cr5Client
from services.robot_gateway.drivers.cr5.tcp_link import TcpLink

pytestmark = pytest.mark.live

HOST = "127.0.0.47"


@pytest.fixture
def process(request: pytest.FixtureRequest) -> Iterator[subprocess.Popen[str]]:
    command = [sys.executable, "-m", "services.cr5_emulator", "--host", HOST]
    command += ["--firmware", getattr(request, "param", "v3")]
    started = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    try:
        assert started.stdout is not None
        assert started.stdout.readline().startswith("ready")
        yield started
    finally:
        started.kill()
        started.wait()
        assert started.stdout is not None
        started.stdout.close()


def connect(port: int) -> socket.socket:
    return socket.create_connection((HOST, port), timeout=5.0)


def ask(line: socket.socket, text: str) -> str:
    line.sendall(text.encode())
    return line.recv(1024).decode()


def test_process_answers_sends_whole_packets_and_ends_in_order(
    process: subprocess.Popen[str],
) -> None:
    with connect(29999) as commands, connect(30004) as feedback:
        assert ask(commands, "EnableRobot()") == "0,{},EnableRobot();"
        data = b""
        while len(data) < 50 * 1440:
            data += feedback.recv(65536)
        assert data[48:56] == bytes.fromhex("EFCDAB8967452301")
        # By the arm's own clock; a busy machine may hand them over in bunches.
        stamps = [int.from_bytes(data[k : k + 8], "little") for k in range(32, 50 * 1440, 1440)]
        np.testing.assert_allclose(np.diff(stamps), 8, atol=1)
        with connect(29999) as second:
            assert second.recv(1) == b"", "a second client is refused"
        assert ask(commands, "RobotMode()") == "0,{5},RobotMode();"
    process.send_signal(signal.SIGTERM)
    assert process.wait(5.0) == 0


@pytest.mark.parametrize(
    ("process", "ports"),
    [
        ("v3", (29999, 30003, 30004, 30005, 30006)),
        ("v4", (29999, 30004, 30005, 30006)),
    ],
    indirect=["process"],
)
def test_a_million_random_bytes_on_every_port_leave_it_answering(
    process: subprocess.Popen[str], ports: tuple[int, ...]
) -> None:
    rng = np.random.default_rng(4)
    deadline = time.monotonic() + 60.0
    for port in ports:
        with connect(port) as line:
            left = 1_000_000
            while left > 0:
                assert time.monotonic() < deadline
                left -= line.send(rng.bytes(min(left, 50_000)))
                drain(line)
    assert process.poll() is None
    while time.monotonic() < deadline:
        # The rubbish is still being worked off; its client must be seen to be gone first.
        with contextlib.suppress(OSError), connect(29999) as line:
            line.sendall(b"RobotMode()")
            if line.recv(1024) == b"0,{4},RobotMode();":
                return
        time.sleep(0.1)
    raise AssertionError("no answer after the rubbish")


def drain(line: socket.socket) -> None:
    """Throws away what has come, as a client that talks rubbish would."""
    line.setblocking(False)
    with contextlib.suppress(BlockingIOError):
        while line.recv(65536):
            pass
    line.settimeout(5.0)


def test_client_gets_over_an_emulator_that_is_killed(process: subprocess.Popen[str]) -> None:
    client = Cr5Client(TcpLink(HOST))

    def until(condition: Callable[[], bool], seconds: float) -> float:
        begun = time.monotonic()
        while not condition():
            assert time.monotonic() - begun < seconds, (client.phase, client.trouble)
            client.step(time.monotonic_ns())
            time.sleep(0.004)
        return time.monotonic() - begun

    until(lambda: not client.lost, 5.0)
    assert client.firmware == "v3"
    client.enable()
    until(lambda: client.enabled, 5.0)
    packet = client.feedback
    assert packet is not None
    client.servo_joints(packet["q_actual"], 0.04)
    process.kill()
    until(lambda: client.lost, 5.0)
    assert not client.enabled
    assert "closed" in client.trouble or "reset" in client.trouble.lower()
    again = subprocess.Popen(process.args, stdout=subprocess.PIPE, text=True)
    try:
        until(lambda: not client.lost, 20.0)
        # Nothing of before is taken up again.
        until(lambda: client.mode == 4, 5.0)
        assert not client.enabled
        client.enable()
        until(lambda: client.enabled, 5.0)
        client.disable()
        until(lambda: client.mode == 4, 5.0)
        client.shut_down()
    finally:
        again.kill()
        again.wait()
        assert again.stdout is not None
        again.stdout.close()


def test_options_of_the_command_line_reach_the_arm_and_are_explained() -> None:
    command = [sys.executable, "-m", "services.cr5_emulator"]
    told = subprocess.run([*command, "--help"], capture_output=True, text=True, check=True).stdout
    for field in fields(EmulatorOptions):
        assert f"--arm.{field.name.replace('_', '-')}" in told
    wrong = subprocess.run(
        [*command, "--firmware", "v4", "--arm.release", "3.5.2"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert wrong.returncode == 2
    assert "there are 4.5, 4.6" in wrong.stderr


def test_end_without_a_cr5_leaves_the_process_idle_and_alive(tmp_path: Path) -> None:
    heartbeat = tmp_path / "heartbeat"
    command = [sys.executable, "-m", "services.cr5_emulator", "--scenario", "fixed-end"]
    command += ["--side", "left", "--host", HOST, "--heartbeat", str(heartbeat)]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    try:
        assert process.stdout is not None
        assert process.stdout.readline().startswith("idle")
        deadline = time.monotonic() + 10.0
        while not heartbeat.exists():
            assert time.monotonic() < deadline
            time.sleep(0.01)
        with pytest.raises(ConnectionRefusedError):
            connect(29999)
        process.send_signal(signal.SIGTERM)
        assert process.wait(10.0) == 0
    finally:
        process.kill()
        process.wait()
        assert process.stdout is not None
        process.stdout.close()
