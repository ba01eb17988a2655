"""Attacks of another user of the machine on a stack: its files, its processes, its bus."""

from __future__ import annotations

import json
import os
import signal
import socket
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

from benchmarks.attacks.attack import Attack, NoControl
from benchmarks.attacks.process_tree import descendants, listening_ports
from benchmarks.live_stack import LiveStack
from shared import bus as buses
from shared.bus import BusOptions, Unreachable
from stack.credentials.local_secret import USER, find_local_secret

WHO = "another user of the machine"
NOBODY = 65534
"""Id of the user that plays the other one."""
JOIN_TIMEOUT = 0.7
"""Longest wait for an answer of the bus [s]."""


def attacks(stack: LiveStack) -> Iterator[Attack]:
    """Read and write what belongs to the stack, as another user.

    Raises:
        NoControl: The stack has no secret, or listens nowhere.
    """
    if os.geteuid():
        yield Attack(WHO, "read files, join the bus, send signals", "left out: needs root", True)
        return
    secret = find_local_secret((stack.hub,))
    pids = descendants(stack.pid)
    ports = listening_ports(pids)
    if secret is None or not ports:
        raise NoControl(f"secret {secret}, ports {ports}: the stack is not the one that was meant")
    temporary = Path(tempfile.gettempdir())
    password = json.loads(secret.read_text())["transport/auth/usrpwd/password"]
    token = stack.address.partition("token=")[2]
    shared_memory = [p for p in Path("/dev/shm").iterdir() if p.stat().st_uid == os.getuid()]
    folders = [*temporary.glob("lariat-*"), secret.parent, stack.folder]
    recordings = list((stack.folder / "recordings").glob("*"))
    sockets = list(temporary.glob("lariat-page-*/viser"))

    def trial(attempt: str, attack: Callable[[], str]) -> Attack:
        found = _as_nobody(attack)
        return Attack(WHO, attempt, found or "refused", held=not found)

    yield trial(
        "read the bus's password", lambda: _readable([secret, secret.with_suffix(".users")])
    )
    yield trial("list the stack's folders", lambda: _listable(folders))
    yield trial("read shared memory", lambda: _readable(shared_memory))
    yield trial("read recordings", lambda: _readable(recordings))
    yield trial("connect to the page's inner socket", lambda: _connectable(sockets))
    yield trial(
        "find a secret in a command line",
        lambda: _containing([Path(f"/proc/{pid}/cmdline") for pid in pids], (password, token)),
    )
    yield trial(
        "read a process's environment",
        lambda: _readable([Path(f"/proc/{p}/environ") for p in pids]),
    )
    yield trial("freeze a process", lambda: _signalled(pids))
    yield trial("join the bus without a password", lambda: _joinable(ports, stack.namespace, ""))
    yield trial(
        "join the bus with a guessed password",
        lambda: _joinable([stack.port], stack.namespace, "guess"),
    )


def _as_nobody(attack: Callable[[], str]) -> str:
    """Return what an attack achieves in a process of another user; empty: nothing."""
    readable, writable = os.pipe()
    child = os.fork()
    if child == 0:
        try:
            os.close(readable)
            os.setgroups([])
            os.setgid(NOBODY)
            os.setuid(NOBODY)
            os.environ.pop("XDG_RUNTIME_DIR", None)
            found = attack()
        except Exception as error:
            found = f"raised {type(error).__name__}: {error}"
        os.write(writable, found.encode()[:4000])
        os._exit(0)
    os.close(writable)
    with os.fdopen(readable, "rb") as answer:
        found = answer.read().decode()
    os.waitpid(child, 0)
    return found


def _tried(things: list, attempt: Callable[..., object], verb: str) -> str:
    """Return which attempts succeed, in words; empty: none."""
    done = []
    for thing in things:
        try:
            attempt(thing)
        except (OSError, Unreachable):
            continue
        done.append(str(thing))
    return f"{verb} {', '.join(done)}" if done else ""


def _readable(paths: list[Path]) -> str:
    return _tried(paths, Path.read_bytes, "reads")


def _listable(folders: list[Path]) -> str:
    return _tried(folders, os.listdir, "lists")


def _signalled(pids: list[int]) -> str:
    return _tried(pids, lambda pid: os.kill(pid, signal.SIGSTOP), "freezes")


def _connectable(paths: list[Path]) -> str:
    def connect(path: Path) -> None:
        with socket.socket(socket.AF_UNIX) as client:
            client.connect(str(path))

    return _tried(paths, connect, "reaches")


def _containing(paths: list[Path], secrets: tuple[str, ...]) -> str:
    found = [str(p) for p in paths if any(s.encode() in p.read_bytes() for s in secrets if s)]
    return f"finds one in {', '.join(found)}" if found else ""


def _joinable(ports: list[int], namespace: str, password: str) -> str:
    def join(port: int) -> None:
        settings = None
        if password:
            settings = Path(tempfile.mkstemp(suffix=".json")[1])
            values = {"user": USER, "password": password}
            settings.write_text(
                json.dumps({f"transport/auth/usrpwd/{key}": v for key, v in values.items()})
            )
        options = BusOptions(namespace, (f"tcp/127.0.0.1:{port}",), (), "client", settings)
        with buses.open(options, "stranger", timeout=JOIN_TIMEOUT):
            pass

    return _tried(ports, join, "joins at")
