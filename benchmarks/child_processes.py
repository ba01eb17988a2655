"""Processes that a launcher has started, by their names."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path


def child_processes(pid: int) -> dict[int, str]:
    """Return the processes that `lariat up` has started: names by id.

    A name is the last part of the module that a process runs, with the side that it is for.
    """
    found = {}
    for tasks in Path(f"/proc/{pid}/task").glob("*/children"):
        for child in map(int, tasks.read_text().split()):
            # It may just have ended.
            with suppress(OSError):
                words = Path(f"/proc/{child}/cmdline").read_bytes().decode().split("\0")
                if name := _name(words):
                    found[child] = name
    return found


def _name(words: list[str]) -> str:
    """Return the name of a process by its command line; empty where it runs no module."""
    places = [k for k, word in enumerate(words) if word.endswith("module_entry.py")]
    if not places:
        return ""
    module = words[places[0] + 1].rpartition(".")[2]
    side = words[words.index("--side") + 1] if "--side" in words else ""
    return f"{module} {side}".rstrip()
