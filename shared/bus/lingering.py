"""Connections of the bus close at once: none of them lingers.

Zenoh sets SO_LINGER to 10 s on every TCP connection (eclipse-zenoh/zenoh#2350). With it, Linux
blocks the thread that closes a connection to a process that reads nothing any more, for as long as
unsent data waits, and that thread is one of the few that serve all connections: a frozen recorder
would stop the images of everybody 2.5 s later. Without it the system sends the rest by itself.
"""

from __future__ import annotations

import os
import socket
import struct
from pathlib import Path

import zenoh

OWN_FILES = Path("/dev/fd")
"""Folder of the files and sockets that this process has open."""
NO_LINGER = struct.pack("ii", 0, 0)
"""Value of SO_LINGER that lets a connection close at once."""


def close_at_once(session: zenoh.Session) -> None:
    """Let every connection of a session, now and later, close without waiting for its data."""
    session.info.declare_link_events_listener(_take_event, history=True)


def _take_event(event: zenoh.LinkEvent) -> None:
    if event.kind == zenoh.SampleKind.PUT:
        ports = _port(event.link.src), _port(event.link.dst)
        for descriptor in os.listdir(OWN_FILES):
            _clear_linger(int(descriptor), ports)


def _port(locator: str) -> int:
    """Return the port of a locator such as tcp/127.0.0.1:7447 or tls/[::1]:7447; 0 without one."""
    port = locator.rpartition(":")[2]
    return int(port) if port.isdecimal() else 0


def _clear_linger(descriptor: int, ports: tuple[int, int]) -> None:
    """Clear SO_LINGER of a file of this process if it is the connection between two ports."""
    try:
        # A copy stays the same connection, whatever the number is used for next.
        copy = os.dup(descriptor)
    except OSError:
        return
    try:
        connection = socket.socket(fileno=copy)
    except OSError:
        os.close(copy)
        return
    with connection:
        try:
            if connection.family not in (socket.AF_INET, socket.AF_INET6):
                return
            if (connection.getsockname()[1], connection.getpeername()[1]) == ports:
                connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, NO_LINGER)
        except OSError:
            return  # It listens, or has just been closed.
