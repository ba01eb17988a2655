"""Attacks on a live stack by those who may not use it: `lariat bench faults attacks`.

Each attacker first shows that they could succeed, or `NoControl` is raised: the refusal of who
could do nothing anyway would prove nothing.
"""

from __future__ import annotations

import json as encoder
import logging
import multiprocessing
import os
import signal
import socket
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import psutil

from benchmarks.faults.hostile_publisher import drawn, publish
from benchmarks.live_stack import LiveStack
from benchmarks.operator import DeadlineMissed, Operator
from benchmarks.tables import PRINT_DEFAULTS, Flat, PrintOptions, Result
from dashboard.controls.hold_path import is_stopped
from lariat.scenario.shipped import find
from shared import bus as buses
from shared import topics
from shared.bus import BusOptions, Unreachable
from shared.bus.message_check import RawMessage
from shared.messages import ArmCommand, ArmStates, TaskRequest
from stack.client import RequestFailed
from stack.credentials.local_secret import find_local_secret

DEFAULT_SCENARIO = Path("three-cylinders")
"""Scenario of the stack: a cell that arms itself, so that whoever gets in could move it."""
NOBODY = 65534
"""Id of the user that plays another one."""
PASSWORD = "transport/auth/usrpwd/password"
"""Setting of the bus that holds the password."""
JOIN_TIMEOUT = 0.5
"""Longest wait for an answer of the bus [s]."""
RECORDING_TIMEOUT = 10.0
"""Longest wait for the first recording [s]."""
PERIOD = 0.02
"""Time between two looks at what the stack says [s]."""
STILL = 1e-4
"""Motion of a grip that counts as none [m]."""
FLOOD_RATE, MIN_REFUSED = 4000.0, 0.1
"""Messages of a flood in a second [Hz], and share of them that the recorder must refuse."""
LISTEN_TIME = 3.0
"""Time in which it is heard who belongs to the stack [s]."""
HOLD_PERIOD, HOLD_TIMEOUT = 1.0, 3.0
"""Time between two holds during a flood, and longest time until one is confirmed [s]."""
RUN_TIMEOUT = 180.0
"""Longest wait for the goal of the lawful run afterwards [s]."""


Row = dict[str, Any]
"""Attempt of somebody who may not do it, what came of it in words, and whether it was refused."""


class NoControl(RuntimeError):
    """What must be possible is not, so that the refusal of an attack would prove nothing."""


def run(
    scenario: Path = DEFAULT_SCENARIO,
    messages: int = 10**6,
    options: Flat[PrintOptions] = PRINT_DEFAULTS,
) -> int:
    """Attack a live stack as another user and as a process on the bus.

    Another user is played by root alone; without it their attacks are left out, and the table says
    so.

    Args:
        scenario: A scenario's TOML file, or the short name of a shipped one.
        messages: Number of messages of all types of a process with the bus's password.

    Returns:
        0 when every attack was refused and nothing moved, 1 otherwise.
    """
    attacks: list[Row] = []
    # What this process is refused is the result, not news.
    logging.disable(logging.WARNING)
    pool = drawn()
    with LiveStack(find(scenario)) as stack:
        # First who forks: the bus has not been joined yet.
        attacks += [*_other_user(stack), *_flood(stack, pool, messages), *_run_afterwards(stack)]
    logging.disable(logging.NOTSET)
    options.publish(Result("attacks", attacks))
    return 0 if attacks and all(each["held"] for each in attacks) else 1


def _row(who: str, attempt: str, outcome: str, held: bool) -> Row:
    return {"who": who, "attempt": attempt, "outcome": outcome, "held": held}


# Another user of the machine


def _other_user(stack: LiveStack) -> Iterator[Row]:
    """Read and write what belongs to the stack, as another user."""
    who = "another user of the machine"
    if os.geteuid():
        yield _row(who, "read files, join the bus, send signals", "left out: needs root", True)
        return
    secret = find_local_secret((stack.hub,))
    pids, ports = _processes(stack)
    recordings = _recordings(stack)
    if secret is None or not ports or not recordings:
        raise NoControl(f"secret {secret}, ports {ports}, recordings {recordings}")
    temporary = Path(tempfile.gettempdir())
    inner = [*temporary.glob("lariat-page-*/viser"), *temporary.glob("lariat-up-*/bus-*")]
    lawful = encoder.loads(secret.read_text())
    token = stack.address.partition("token=")[2]
    hidden = (lawful[PASSWORD].encode(), token.encode())

    def join(port: int, settings: dict[str, str]) -> None:
        # The list of users is for those who listen.
        own = {k: value for k, value in settings.items() if not k.endswith("dictionary_file")}
        with tempfile.NamedTemporaryFile("w", suffix=".json") as file:
            encoder.dump(own, file)
            file.flush()
            hub = (f"tcp/127.0.0.1:{port}",)
            options = BusOptions(stack.namespace, hub, (), "client", Path(file.name))
            with buses.open(options, "stranger", timeout=JOIN_TIMEOUT):
                pass

    def find_secret(path: Path) -> None:
        text = path.read_bytes()
        if not any(each in text for each in hidden):
            raise PermissionError("no secret")

    with tempfile.NamedTemporaryFile() as public:
        os.chmod(public.name, 0o644)
        if not _as_nobody([Path(public.name)], Path.read_bytes):
            raise NoControl("the other user cannot even read a public file")
    if _as_nobody([stack.port], lambda port: join(port, lawful)) != str(stack.port):
        raise NoControl("the password does not admit either")
    processes = [Path(f"/proc/{pid}") for pid in pids]
    for attempt, things, attack in (
        ("read the bus's password", [secret, secret.with_suffix(".users")], Path.read_bytes),
        ("list private folders", [*temporary.glob("lariat-*"), secret.parent], os.listdir),
        ("read recordings", recordings, Path.read_bytes),
        ("reach an inner socket", inner, _connect),
        ("find a secret in a command line", [p / "cmdline" for p in processes], find_secret),
        ("read a process's environment", [p / "environ" for p in processes], Path.read_bytes),
        ("freeze a process", pids, lambda pid: os.kill(pid, signal.SIGSTOP)),
        ("join the bus without a password", ports, lambda port: join(port, {})),
        (
            "join the bus with a guessed password",
            [stack.port],
            lambda port: join(port, lawful | {PASSWORD: "guess"}),
        ),
    ):
        achieved = _as_nobody(things, attack)
        outcome = achieved or (f"none of {len(things)}" if things else "there is nothing to try")
        yield _row(who, attempt, outcome, held=not achieved)


def _as_nobody(things: Sequence[Any], attack: Callable[[Any], object]) -> str:
    """Return the things at which an attack of another user succeeds, in words; empty: none."""

    def succeeds(thing: Any) -> bool:
        try:
            attack(thing)
        except (OSError, Unreachable):
            return False
        return True

    readable, writable = os.pipe()
    child = os.fork()
    if child == 0:
        try:
            os.close(readable)
            os.setgroups([])
            os.setgid(NOBODY)
            os.setuid(NOBODY)
            # At once: the bus does not answer whom it refuses.
            with ThreadPoolExecutor(len(things) or 1) as pool:
                done = pool.map(succeeds, things)
                achieved = ", ".join(str(t) for t, each in zip(things, done, strict=True) if each)
        except BaseException as error:
            achieved = f"raised {type(error).__name__}: {error}"
        os.write(writable, achieved.encode()[:4000])
        os._exit(0)
    os.close(writable)
    with os.fdopen(readable, "rb") as answer:
        achieved = answer.read().decode()
    os.waitpid(child, 0)
    return achieved


def _recordings(stack: LiveStack) -> list[Path]:
    """Return the files of the recorder, once there is one."""
    deadline = time.monotonic() + RECORDING_TIMEOUT
    while not (files := list((stack.folder / "recordings").glob("*.mcap"))):
        if time.monotonic() > deadline:
            break
        time.sleep(PERIOD)
    return files


def _connect(path: Path) -> None:
    with socket.socket(socket.AF_UNIX) as client:
        client.connect(str(path))


def _processes(stack: LiveStack) -> tuple[list[int], list[int]]:
    """Return the processes of a stack, and the ports on which they listen."""
    launcher = psutil.Process(stack.pid)
    processes = [launcher, *launcher.children(recursive=True)]
    sockets = [s for process in processes for s in process.net_connections("tcp")]
    ports = {s.laddr.port for s in sockets if s.status == psutil.CONN_LISTEN}
    return [process.pid for process in processes], sorted(ports)


# A process with the bus's password


def _flood(stack: LiveStack, pool: Sequence[tuple[RawMessage, bool]], count: int) -> Iterator[Row]:
    """Publish messages of all types, valid and invalid, while a person presses HOLD."""
    before, moved, waits, hold = _processes(stack)[0], 0.0, list[float](), ""
    refused: dict[str, int] = {}
    with stack.connect() as client:
        states, health = (client.bus.subscribe(t) for t in (topics.ARM_STATE, topics.HEALTH))
        # A run that a person started ends, or goes on correcting the rope at its goal.
        client.command_arms(ArmCommand.HOLD)
        # Whose word counts, by key: what others say is forged.
        own, end = dict[str, str](), time.monotonic() + LISTEN_TIME
        while time.monotonic() < end:
            own |= {key: item.publisher for key, item in (*states.take(), *health.take())}
            time.sleep(PERIOD)
        rest, begun, pressed = _grip_positions(client.newest_arm_state()), 0.0, 0.0
        messages = (pool, stack.hub, stack.namespace, FLOOD_RATE, count)
        flood = multiprocessing.get_context("spawn").Process(target=publish, args=messages)
        flood.start()
        try:
            while flood.is_alive() or hold:
                now = time.monotonic()
                if not hold and now > pressed + HOLD_PERIOD:
                    hold, pressed = client.send_to_arms(ArmCommand.HOLD, ArmStates()), now
                for key, item in states.take():
                    begun = begun or (now if item.publisher != own[key] else 0.0)
                    if item.publisher == own[key]:
                        way = np.abs(_grip_positions(item.message) - rest)
                        moved = max(moved, float(np.max(way)))
                        obeyed = item.message.last_command == hold and not item.message.refusal
                        if hold and (obeyed or is_stopped(item.message)):
                            hold, waits = "", [*waits, now - pressed]
                for key, item in health.take():
                    if item.publisher == own.get(key):
                        refused[item.message.service] = item.message.refused
                if hold and now > pressed + HOLD_TIMEOUT:
                    hold, waits = "", [*waits, float("inf")]
                time.sleep(PERIOD)
        finally:
            flood.terminate()
            flood.join()
        seconds = time.monotonic() - begun
    # The recorder reads all topics.
    if flood.exitcode or not waits or refused.get("recorder", 0) < MIN_REFUSED * count:
        raise NoControl(f"no flood: exit code {flood.exitcode}, refused {refused}")
    same = _processes(stack)[0] == before
    outcome = f"{seconds:.0f} s, the recorder refuses {refused['recorder']:,}; "
    outcome += f"a grip moves by {1e3 * moved:.2f} mm, "
    outcome += f"{len(waits)} holds are confirmed, p99 {np.percentile(waits, 99):.2f} s, "
    outcome += "the processes are the same" if same else "a process ended"
    who, held = "a process with the bus's password", same and moved < STILL
    held = held and max(waits) < HOLD_TIMEOUT
    yield _row(who, f"{count:,} messages of all types", outcome, held)


def _run_afterwards(stack: LiveStack) -> Iterator[Row]:
    """Restore the scene, arm and run, as a person does after all of this."""
    with stack.connect() as client:
        operator, failure = Operator(client), ""
        try:
            client.command_arms(ArmCommand.DISARM)
            client.request_task(TaskRequest.RESTORE)
            client.command_arms(ArmCommand.ARM)
            operator.run_to_goal(RUN_TIMEOUT)
        except (DeadlineMissed, RequestFailed) as error:
            failure = str(error)
    outcome = failure or f"reaches the goal after {len(operator.stops)} acknowledged stops"
    yield _row("a person", "a run after all of this", outcome, not failure)


def _grip_positions(state: ArmStates) -> np.ndarray:
    """Return the positions of the grips [m]."""
    return np.array([arm.position for arm in state.arms])
