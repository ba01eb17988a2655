"""The real stack for a browser to look at."""

from __future__ import annotations

import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager


def free_port() -> int:
    """A port of loopback that nobody listens on."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


READY = "dashboard at http"
"""What `lariat up` says when all is ready."""


@contextmanager
def running(scenario: str, patience: float = 300.0) -> Iterator[str]:
    """`lariat up` on free ports, ended with Ctrl-C.

    Args:
        patience: How long to wait for it [s]; kernels may have to be compiled.

    Yields:
        The page's address.
    """
    port, page = free_port(), free_port()
    command = [sys.executable, "-m", "cli", "up", scenario, "--no-record"]
    command += ["--port", str(port), "--dashboard-port", str(page), "--namespace", f"test-{port}"]
    process = subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, bufsize=1
    )
    spoken = threading.Event()
    lines: list[str] = []

    def read() -> None:
        assert process.stdout is not None
        for line in process.stdout:
            lines.append(line)
            if READY in line:
                spoken.set()
        spoken.set()

    reader = threading.Thread(target=read, daemon=True)
    reader.start()
    try:
        if not spoken.wait(patience) or not any(READY in line for line in lines):
            raise AssertionError(f"the stack did not come up:\n{''.join(lines[-30:])}")
        yield f"http://127.0.0.1:{page}"
    finally:
        process.send_signal(signal.SIGINT)
        try:
            process.wait(15.0)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
