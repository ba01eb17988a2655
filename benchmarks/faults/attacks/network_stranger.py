"""Attacks of another machine of the network on a stack, played by a network namespace."""

from __future__ import annotations

import json
import os
import socket
import subprocess
import sys
from collections.abc import Iterator

from benchmarks.faults.attacks.attack import Attack, NoControl
from benchmarks.faults.attacks.process_tree import descendants, listening_ports
from benchmarks.faults.machines import ROBOT, cable, on_second_machine
from benchmarks.live_stack import LiveStack
from lariat.configuration import ConfigurationError

WHO = "another machine of the network"
PROBE = """
import json, socket, sys
reached = []
for port in map(int, sys.argv[2:]):
    with socket.socket() as probe:
        probe.settimeout(1.0)
        if probe.connect_ex((sys.argv[1], port)) == 0:
            reached.append(port)
print(json.dumps(reached))
"""
"""Program that prints which ports of a host accept a connection."""


def attacks(stack: LiveStack) -> Iterator[Attack]:
    """Connect to every port on which the stack listens, from another machine.

    Raises:
        NoControl: Not even a port that is open to all is reached.
    """
    attempt = "connect to every port of the stack"
    if os.geteuid():
        yield Attack(WHO, attempt, "left out: needs root", held=True)
        return
    ports = listening_ports(descendants(stack.pid))
    try:
        with cable(), socket.create_server((ROBOT, 0)) as control:
            open_port = control.getsockname()[1]
            command = [sys.executable, "-c", PROBE, ROBOT, *map(str, (open_port, *ports))]
            answer = subprocess.run(
                on_second_machine(command), capture_output=True, text=True, timeout=60, check=True
            )
    except ConfigurationError as error:
        yield Attack(WHO, attempt, f"left out: {error}", held=True)
        return
    reached = json.loads(answer.stdout)
    if open_port not in reached or not ports:
        raise NoControl(f"the stack listens on {ports}; reached from the namespace: {reached}")
    reached.remove(open_port)
    outcome = f"reaches {reached}" if reached else f"none of {len(ports)} answers"
    yield Attack(WHO, attempt, outcome, held=not reached)
