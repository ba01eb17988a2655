"""The emulated arm as a process on its real ports."""

from __future__ import annotations

import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator

import numpy as np
import pytest

HOST = "127.0.0.47"


@pytest.fixture
def process() -> Iterator[subprocess.Popen[str]]:
    command = [sys.executable, "-m", "services.robot_gateway.emulator", "--host", HOST]
    started = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    try:
        assert started.stdout is not None
        assert started.stdout.readline().startswith("ready")
        yield started
    finally:
        started.kill()
        started.wait()


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
        begun = time.monotonic()
        data = b""
        while len(data) < 50 * 1440:
            data += feedback.recv(65536)
        period = (time.monotonic() - begun) / 50
        assert data[48:56] == bytes.fromhex("EFCDAB8967452301")
        assert 0.006 < period < 0.016
        with connect(29999) as second:
            assert second.recv(1) == b"", "a second client is refused"
        assert ask(commands, "RobotMode()") == "0,{5},RobotMode();"
    process.send_signal(signal.SIGTERM)
    assert process.wait(5.0) == 0


def test_random_bytes_on_every_port_leave_it_answering(process: subprocess.Popen[str]) -> None:
    rng = np.random.default_rng(4)
    for port in (29999, 30003, 30004, 30005, 30006):
        with connect(port) as line:
            for _ in range(10):
                line.sendall(rng.bytes(20_000))
    assert process.poll() is None
    deadline = time.monotonic() + 10.0
    while time.monotonic() < deadline:
        # The rubbish is still being worked off; its client must be seen to be gone first.
        with connect(29999) as line:
            line.sendall(b"RobotMode()")
            if line.recv(1024) == b"0,{4},RobotMode();":
                return
        time.sleep(0.1)
    raise AssertionError("no answer after the rubbish")
