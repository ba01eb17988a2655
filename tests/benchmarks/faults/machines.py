"""Second machine: a network namespace of this one, joined by a cable; root alone may make it."""

from __future__ import annotations

import contextlib
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager

from lariat.configuration import ConfigurationError

ROBOT, VISION = "10.77.77.1", "10.77.77.2"
"""Addresses of the two machines."""
NAMESPACE = "lariat-vision"
"""Network namespace of the second machine."""
CABLE = ("lariat-cable-0", "lariat-cable-1")
"""Ends of the cable: on the first machine, and on the second."""
PORT = 7448
"""Port of the router."""


@contextmanager
def cable() -> Iterator[None]:
    """Create the second machine and the cable to it, and remove them.

    Raises:
        ConfigurationError: Network namespaces are not allowed here.
    """
    here, there = CABLE
    try:
        _ip("netns", "add", NAMESPACE)
        _ip("link", "add", here, "type", "veth", "peer", "name", there, "netns", NAMESPACE)
        _ip("address", "add", f"{ROBOT}/30", "dev", here)
        _ip("-n", NAMESPACE, "address", "add", f"{VISION}/30", "dev", there)
        _ip("link", "set", here, "up")
        _ip("-n", NAMESPACE, "link", "set", there, "up")
    except (OSError, subprocess.SubprocessError) as error:
        _remove()
        raise ConfigurationError(f"network namespaces are not allowed here: {error}") from None
    try:
        yield
    finally:
        _remove()


def set_cable(connected: bool) -> None:
    """Plug the cable in, or pull it out."""
    _ip("link", "set", CABLE[0], "up" if connected else "down")


def on_second_machine(command: list[str]) -> list[str]:
    """Return a command that runs another one on the second machine."""
    return ["ip", "netns", "exec", NAMESPACE, *command]


def _ip(*arguments: str) -> None:
    subprocess.run(["ip", *arguments], check=True, capture_output=True, timeout=10)


def _remove() -> None:
    for arguments in (("link", "delete", CABLE[0]), ("netns", "delete", NAMESPACE)):
        with contextlib.suppress(OSError, subprocess.SubprocessError):
            _ip(*arguments)
