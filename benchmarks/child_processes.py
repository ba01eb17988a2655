"""Processes that a launcher has started, by their names."""

from __future__ import annotations

from contextlib import suppress

import psutil


def child_processes(pid: int) -> dict[int, str]:
    """Return the processes that `lariat up` has started: names by id.

    A name is the last part of the module that a process runs, with the side that it is for.
    """
    names = {}
    for child in psutil.Process(pid).children():
        # It may just have ended.
        with suppress(psutil.Error):
            if name := _name(child.cmdline()):
                names[child.pid] = name
    return names


def processor_times(pid: int) -> tuple[float, float]:
    """Return the processor times of a process, and of its children that have ended [s]."""
    times = psutil.Process(pid).cpu_times()
    return times.user + times.system, times.children_user + times.children_system


def _name(words: list[str]) -> str:
    """Return the name of a process by its command line; empty where it runs no module."""
    places = [k for k, word in enumerate(words) if word.endswith("module_entry.py")]
    if not places:
        return ""
    module = words[places[0] + 1].rpartition(".")[2]
    side = words[words.index("--side") + 1] if "--side" in words else ""
    return f"{module} {side}".rstrip()
