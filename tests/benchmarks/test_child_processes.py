"""Processes of a stack have the names of what they run."""

from __future__ import annotations

import os
import subprocess
import sys

from benchmarks.child_processes import child_processes
from stack.launcher import module_entry

WAIT = "print(flush=True); input()"


def test_a_child_is_named_by_its_module_and_side() -> None:
    entry = module_entry.command("services.cr5_emulator", "--side", "left")[1:]
    command = [sys.executable, "-c", WAIT, *entry]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as child:
        assert child.stdout is not None
        child.stdout.readline()
        other = subprocess.Popen([sys.executable, "-c", WAIT], stdin=subprocess.PIPE)
        assert child_processes(os.getpid())[child.pid] == "cr5_emulator left"
        assert other.pid not in child_processes(os.getpid())
        other.communicate(b"\n")
        child.communicate(b"\n")
    assert child.pid not in child_processes(os.getpid())
