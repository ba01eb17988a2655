"""Two machines of one cell, in network namespaces: certificates, a router, a cut, its healing."""

from __future__ import annotations

import contextlib
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from shared import bus as buses
from shared import topics
from shared.bus import BusOptions
from stack.credentials.cell_credentials import make_credentials
from tests.shared.cell import until

ROOT = Path(__file__).parents[2]
ROBOT, VISION = "10.77.77.1", "10.77.77.2"
"""Addresses of the two machines."""
PORT = 7447
REMOTE = "lariat-test-vision"
"""Network namespace of the second machine."""
LINK, REMOTE_LINK = "lariat-test0", "lariat-test1"
"""Ends of the cable between them."""


def _ip(*arguments: str) -> None:
    subprocess.run(["ip", *arguments], check=True, capture_output=True, timeout=10)


@pytest.fixture
def cable() -> Iterator[None]:
    """Two machines with a cable between them; this process runs on the first one."""
    try:
        _ip("netns", "add", REMOTE)
        _ip("link", "add", LINK, "type", "veth", "peer", "name", REMOTE_LINK, "netns", REMOTE)
        _ip("address", "add", f"{ROBOT}/30", "dev", LINK)
        _ip("link", "set", LINK, "up")
        _ip("-n", REMOTE, "address", "add", f"{VISION}/30", "dev", REMOTE_LINK)
        _ip("-n", REMOTE, "link", "set", REMOTE_LINK, "up")
    except (OSError, subprocess.SubprocessError) as error:
        _remove()
        pytest.skip(f"network namespaces are not allowed here: {error}")
    try:
        yield
    finally:
        _remove()


def _remove() -> None:
    for arguments in (("link", "delete", LINK), ("netns", "delete", REMOTE)):
        with contextlib.suppress(OSError, subprocess.SubprocessError):
            _ip(*arguments)


def test_service_of_another_machine_is_heard_again_after_a_cut(cable: None, tmp_path: Path) -> None:
    make_credentials(tmp_path, (ROBOT,), "cell", days=90)
    endpoint = f"tls/{ROBOT}:{PORT}"
    router = BusOptions("cell", (), (endpoint,), "router", tmp_path / "router" / "bus.json")
    settings = tmp_path / "controller" / "bus.json"
    options = BusOptions("cell", (endpoint,), (), "client", settings)
    # The planner of a scenario without a camera loads fastest of the services.
    command = [sys.executable, "-m", "services.planner", "--scenario", "twenty-posts"]
    command += ["--mode", "client", "--connect", endpoint, "--listen"]
    command += ["--settings", str(tmp_path / "planner" / "bus.json")]
    with buses.open(router, "router"), buses.open(options, "controller", timeout=5.0) as bus:
        health = bus.subscribe(topics.HEALTH.at("planner"))
        planner = subprocess.Popen(["ip", "netns", "exec", REMOTE, *command], cwd=ROOT)
        try:
            until(health.take, 90.0)
            assert bus.alive() == {"planner"}
            _ip("link", "set", LINK, "down")
            until(lambda: bus.alive() == set(), 15.0)
            time.sleep(1.0)
            assert planner.poll() is None, "a cut line must not end a process"
            health.take()
            _ip("link", "set", LINK, "up")
            until(health.take, 30.0)
            assert bus.alive() == {"planner"}
        finally:
            planner.terminate()
            planner.wait(10.0)
