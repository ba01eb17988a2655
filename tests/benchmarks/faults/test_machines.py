"""Two machines of one cell, in network namespaces: certificates, a router, a cut, its healing."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from lariat.configuration import ConfigurationError
from shared import bus as buses
from shared import topics
from shared.bus import BusOptions
from stack.credentials.cell_credentials import make_credentials
from tests.benchmarks.faults.machines import PORT, ROBOT, cable, on_second_machine, set_cable
from tests.shared.cell import until

pytestmark = pytest.mark.live

ROOT = Path(__file__).parents[3]


@pytest.fixture
def second_machine() -> Iterator[None]:
    machine = cable()
    try:
        machine.__enter__()
    except ConfigurationError as error:
        pytest.skip(str(error))
    yield
    machine.__exit__(None, None, None)


def test_service_of_another_machine_is_heard_again_after_a_cut(
    second_machine: None, tmp_path: Path
) -> None:
    make_credentials(tmp_path, (ROBOT,), "cell", days=90)
    endpoint = f"tls/{ROBOT}:{PORT}"
    router = BusOptions("cell", (), (endpoint,), "router", tmp_path / "router" / "bus.json")
    settings = tmp_path / "controller" / "bus.json"
    options = BusOptions("cell", (endpoint,), (), "client", settings)
    # The gateway of ideal arms compiles nothing.
    command = [sys.executable, "-m", "services.robot_gateway", "--scenario", "twenty-posts"]
    command += ["--mode", "client", "--connect", endpoint, "--listen"]
    command += ["--settings", str(tmp_path / "robot_gateway" / "bus.json")]
    with buses.open(router, "router"), buses.open(options, "controller", timeout=5.0) as bus:
        health = bus.subscribe(topics.HEALTH.at("robot_gateway"))
        gateway = subprocess.Popen(on_second_machine(command), cwd=ROOT)
        try:
            until(health.take, 90.0)
            assert bus.alive() == {"robot_gateway"}
            set_cable(False)
            until(lambda: bus.alive() == set(), 15.0)
            assert gateway.poll() is None, "a cut line must not end a process"
            health.take()
            set_cable(True)
            until(health.take, 30.0)
            assert bus.alive() == {"robot_gateway"}
        finally:
            gateway.terminate()
            gateway.wait(10.0)
