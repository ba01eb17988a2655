"""Fork server: forks processes of the stack that need not import what all of them share.

    python -P module_entry.py stack.launcher.fork_server_process CHANNEL LAUNCHER PADDING

It imports `SHARED_MODULES` and forks a process for each request of the launcher. This process has
one thread and opens nothing, so a copy of it is as good as a new interpreter. A copy belongs to the
launcher, which adopts it (prctl(2), PR_SET_CHILD_SUBREAPER): it outlives this process, its parent
sees its exit code, and it ends when the launcher does.
"""

from __future__ import annotations

import ctypes
import gc
import importlib
import json
import os
import runpy
import signal
import socket
import sys
import time
from dataclasses import dataclass
from pathlib import Path

from stack.launcher import child_process, module_entry

SHARED_MODULES = (
    "shared.runtime.live",
    "lariat.scenario.extensions",
    "lariat.protocols",
    "lariat.rod",
    "dashboard.web.site",
)
"""Modules that most processes of the stack import, and the dashboard before its HOLD works; none of
them starts a thread."""
MAX_REQUEST_SIZE = 65536
"""Largest request [bytes]."""
GO = b"g"
"""Answer of the launcher to the pid of a process that it has adopted."""
ADOPTION_TIMEOUT = 5.0
"""Longest wait of a process for its adoption [s]."""


@dataclass(frozen=True)
class ForkRequest:
    """Process to fork. Two files go with it: a socket to the launcher, and the output."""

    module: str
    """Dotted name of the module to run."""
    arguments: tuple[str, ...]
    """Arguments of the module."""
    death_signal: int
    """Signal that the kernel sends it when the launcher dies."""
    niceness: int
    """Its scheduling priority, nice(2)."""


def main() -> None:
    """Serve requests until the launcher ends; in each process that is forked, run its module."""
    channel, launcher = socket.socket(fileno=int(sys.argv[1])), int(sys.argv[2])
    child_process.end_with(launcher, signal.SIGKILL)
    show_command_line(sys.executable, *module_entry.command(__spec__.name))
    for name in SHARED_MODULES:
        importlib.import_module(name)
    _read_options_once()
    # Garbage collection in the copies visits, and so copies, nothing that exists now.
    gc.collect()
    gc.freeze()
    request = _serve(channel, launcher)
    if request is not None:
        show_command_line(sys.executable, *module_entry.command(request.module, *request.arguments))
        sys.argv[:] = [request.module, *request.arguments]
        runpy.run_module(request.module, run_name="__main__", alter_sys=True)


def _read_options_once() -> None:
    """Let the parser of command lines keep what it finds out about the options of all services."""
    import tyro

    from shared.runtime.live import LiveOptions

    tyro.cli(LiveOptions, args=[])


def _serve(channel: socket.socket, launcher: int) -> ForkRequest | None:
    """Fork for each request; return it in the process that was forked, None when all are done."""
    while True:
        message, files, _, _ = socket.recv_fds(channel, MAX_REQUEST_SIZE, 2)
        if not message:
            return None
        parent = os.fork()
        if not parent:
            if os.fork():
                # The process whose parent ends here is the launcher's from now on.
                os._exit(0)
            channel.close()
            request = ForkRequest(**json.loads(message))
            _begin(request, launcher, *files)
            return request
        for file in files:
            os.close(file)
        os.waitpid(parent, 0)


def _begin(request: ForkRequest, launcher: int, control: int, output: int) -> None:
    """Make a forked process one of the launcher's, which must know it before it does anything."""
    deadline = time.monotonic() + ADOPTION_TIMEOUT
    while os.getppid() != launcher and time.monotonic() < deadline:
        time.sleep(0.001)
    child_process.end_with(launcher, request.death_signal)
    os.setsid()
    with socket.socket(fileno=control) as answers:
        answers.send(str(os.getpid()).encode())
        if answers.recv(1) != GO:
            os._exit(1)
    for standard in (1, 2):
        os.dup2(output, standard)
    os.close(output)
    child_process.set_niceness(request.niceness)


def show_command_line(*words: str) -> None:
    """Write a command line over that of this process, for ps(1); what has no room is cut off."""
    # arg_start and arg_end, see proc(5); the name, in parentheses, may hold anything.
    fields = Path("/proc/self/stat").read_text().rpartition(")")[2].split()
    start, end = int(fields[45]), int(fields[46])
    text = b"".join(word.encode() + b"\0" for word in words)[: end - start - 1]
    ctypes.memmove(start, text.ljust(end - start, b"\0"), end - start)


if __name__ == "__main__":
    main()
