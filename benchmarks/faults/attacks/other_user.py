"""Attacks of another user of the machine on a stack: its files, its processes, its bus."""

from __future__ import annotations

import json
import os
import signal
import socket
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

from benchmarks.faults.attacks.attack import Attack, NoControl
from benchmarks.faults.attacks.process_tree import descendants, listening_ports
from benchmarks.live_stack import LiveStack
from shared import bus as buses
from shared.bus import BusOptions, Unreachable
from stack.credentials.local_secret import find_local_secret

WHO = "another user of the machine"
NOBODY = 65534
"""Id of the user that plays the other one."""
AUTHENTICATION = "transport/auth/usrpwd"
"""First part of the settings of user and password."""
JOIN_TIMEOUT = 0.5
"""Longest wait for an answer of the bus [s]."""
RECORDING_TIMEOUT = 10.0
"""Longest wait for the first recording [s]."""
POLL_PERIOD = 0.1
"""Time between two looks for it [s]."""


def attacks(stack: LiveStack) -> Iterator[Attack]:
    """Read and write what belongs to the stack, as another user.

    Raises:
        NoControl: There is nothing to attack, or the other user could not do so anyway.
    """
    if os.geteuid():
        yield Attack(WHO, "read files, join the bus, send signals", "left out: needs root", True)
        return
    secret = find_local_secret((stack.hub,))
    pids = descendants(stack.pid)
    ports = listening_ports(pids)
    recordings = _recordings(stack)
    if secret is None or not ports or not recordings:
        raise NoControl(f"secret {secret}, ports {ports}, recordings {recordings}")
    temporary = Path(tempfile.gettempdir())
    known = json.loads(secret.read_text())
    token = stack.address.partition("token=")[2]
    memory = [p for p in Path("/dev/shm").iterdir() if p.stat().st_uid == os.getuid()]
    processes = [Path(f"/proc/{pid}") for pid in pids]
    _check_controls(stack, known)
    for attempt, things, attack in (
        ("read the bus's password", [secret, secret.with_suffix(".users")], Path.read_bytes),
        ("list private folders", [*temporary.glob("lariat-*"), secret.parent], os.listdir),
        ("read shared memory", memory, Path.read_bytes),
        ("read recordings", recordings, Path.read_bytes),
        ("reach the page's inner socket", list(temporary.glob("lariat-page-*/viser")), _connect),
        (
            "find a secret in a command line",
            [process / "cmdline" for process in processes],
            lambda path: _find(path, (known[f"{AUTHENTICATION}/password"], token)),
        ),
        ("read a process's environment", [p / "environ" for p in processes], Path.read_bytes),
        ("freeze a process", pids, lambda pid: os.kill(pid, signal.SIGSTOP)),
        ("join the bus without a password", ports, lambda port: _join(stack, port, {})),
        (
            "join the bus with a guessed password",
            [stack.port],
            lambda port: _join(stack, port, known | {f"{AUTHENTICATION}/password": "guess"}),
        ),
    ):
        achieved = _as_nobody(lambda t=things, a=attack: _tried(t, a))
        outcome = achieved or (f"none of {len(things)}" if things else "there is nothing to try")
        yield Attack(WHO, attempt, outcome, held=not achieved)


def _recordings(stack: LiveStack) -> list[Path]:
    """Return the files of the recorder, once there is one."""
    deadline = time.monotonic() + RECORDING_TIMEOUT
    while not (found := list((stack.folder / "recordings").glob("*.mcap"))):
        if time.monotonic() > deadline:
            break
        time.sleep(POLL_PERIOD)
    return found


def _check_controls(stack: LiveStack, known: dict[str, str]) -> None:
    """Check that the other user can do what everybody may, and what the password permits.

    Raises:
        NoControl: They cannot, so that a refusal would prove nothing.
    """
    with tempfile.NamedTemporaryFile() as public:
        os.chmod(public.name, 0o644)
        if not _as_nobody(lambda: _tried([Path(public.name)], Path.read_bytes)):
            raise NoControl("the other user cannot even read a public file")
    joined = _as_nobody(lambda: _tried([stack.port], lambda port: _join(stack, port, known)))
    if joined != str(stack.port):
        raise NoControl(f"the password does not admit either: {joined}")


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
            achieved = attack()
        except BaseException as error:
            achieved = f"raised {type(error).__name__}: {error}"
        os.write(writable, achieved.encode()[:4000])
        os._exit(0)
    os.close(writable)
    with os.fdopen(readable, "rb") as answer:
        achieved = answer.read().decode()
    os.waitpid(child, 0)
    return achieved


def _tried(things: Sequence[Any], attack: Callable[[Any], object]) -> str:
    """Return the things at which an attack succeeds, in words; empty: none."""

    def succeeds(thing: Any) -> bool:
        try:
            attack(thing)
        except (OSError, Unreachable):
            return False
        return True

    # At once: the bus does not answer whom it refuses.
    with ThreadPoolExecutor(len(things) or 1) as pool:
        done = list(pool.map(succeeds, things))
    return ", ".join(str(thing) for thing, each in zip(things, done, strict=True) if each)


def _connect(path: Path) -> None:
    with socket.socket(socket.AF_UNIX) as client:
        client.connect(str(path))


def _find(path: Path, secrets: tuple[str, ...]) -> None:
    text = path.read_bytes()
    if not any(secret.encode() in text for secret in secrets):
        raise PermissionError("no secret")


def _join(stack: LiveStack, port: int, settings: dict[str, str]) -> None:
    # The list of users is for those who listen.
    own = {key: value for key, value in settings.items() if not key.endswith("dictionary_file")}
    with tempfile.NamedTemporaryFile("w", suffix=".json") as file:
        json.dump(own, file)
        file.flush()
        endpoint = f"tcp/127.0.0.1:{port}"
        options = BusOptions(stack.namespace, (endpoint,), (), "client", Path(file.name))
        with buses.open(options, "stranger", timeout=JOIN_TIMEOUT):
            pass
