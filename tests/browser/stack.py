"""Live stack for a browser to connect to."""

from __future__ import annotations

import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager

from shared.runtime.free_port import free_port

READY_TEXT = "dashboard at http"
"""Text that `lariat up` prints when all services are ready."""


@contextmanager
def running(scenario: str, timeout: float = 300.0) -> Iterator[str]:
    """Run `lariat up` on free ports and end it with Ctrl-C.

    Args:
        timeout: Longest start-up [s]; kernels may have to be compiled.

    Yields:
        Address of the page.
    """
    port, page = free_port(), free_port()
    command = [sys.executable, "-m", "cli", "up", scenario, "--no-record"]
    command += ["--port", str(port), "--dashboard-port", str(page), "--namespace", f"test-{port}"]
    process = subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, bufsize=1
    )
    reported = threading.Event()
    lines: list[str] = []

    def read() -> None:
        assert process.stdout is not None
        for line in process.stdout:
            lines.append(line)
            if READY_TEXT in line:
                reported.set()
        reported.set()

    reader = threading.Thread(target=read, daemon=True)
    reader.start()
    try:
        if not reported.wait(timeout) or not any(READY_TEXT in line for line in lines):
            raise AssertionError(f"the stack did not come up:\n{''.join(lines[-30:])}")
        yield next(line for line in lines if READY_TEXT in line).split()[-1]
    finally:
        process.send_signal(signal.SIGINT)
        try:
            process.wait(15.0)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
