"""Ports on which this process listens."""

from __future__ import annotations

import os
from pathlib import Path

LISTENING = "0A"
"""State of a listening socket in /proc/net/tcp."""


def tcp_listeners() -> set[int]:
    """Return the TCP ports on which this process listens."""
    inodes = set()
    for entry in os.scandir("/proc/self/fd"):
        try:
            inodes.add(os.readlink(entry.path).removeprefix("socket:[").rstrip("]"))
        except OSError:
            continue
    ports = set()
    for table in ("/proc/net/tcp", "/proc/net/tcp6"):
        for line in Path(table).read_text().splitlines()[1:]:
            fields = line.split()
            if fields[3] == LISTENING and fields[9] in inodes:
                ports.add(int(fields[1].rpartition(":")[2], 16))
    return ports
