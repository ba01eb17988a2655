from __future__ import annotations

import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from dashboard.options import DashboardOptions
from dashboard.service import DashboardService, build
from lariat.configuration import ConfigurationError
from lariat.scenario import load
from shared.messages import TaskRequest
from tests.dashboard.stage import Stage

SCENARIO = load("scenarios/three-cylinders.toml")


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


@contextmanager
def served(port: int) -> Iterator[DashboardService]:
    service = build(SCENARIO, "dashboard-ab", DashboardOptions(port=port))
    service.warm_up()
    try:
        yield service
    finally:
        service.close()


def test_taken_port_is_refused_and_not_replaced() -> None:
    port = free_port()
    with (
        served(port),
        pytest.raises(ConfigurationError, match=f"port {port} .* taken"),
    ):
        build(SCENARIO, "dashboard-cd", DashboardOptions(port=port))


def test_service_publishes_no_request_without_a_person() -> None:
    with served(free_port()) as service:
        stage = Stage(service, SCENARIO)
        assert stage.step() == []
        for k in range(8):
            stage.play(k / 7.0)
            stage.picture()
            assert stage.step() == []


def test_what_cannot_be_shown_is_refused_and_a_request_still_leaves(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    with served(free_port()) as service:
        stage = Stage(service, SCENARIO)

        def fail(*_: object) -> None:
            raise KeyError("x")

        monkeypatch.setattr(service._page, "update", fail)
        service.outbox.request_task(TaskRequest.STOP, "stop")
        (published,) = stage.step()
        assert published.message.action == TaskRequest.STOP
        assert service.door.refused == 1


@pytest.mark.parametrize("path", sorted(Path("scenarios").glob("*.toml")), ids=lambda p: p.stem)
def test_every_scenario_can_be_shown(path: Path) -> None:
    scenario = load(path)
    service = build(scenario, "dashboard-ab", DashboardOptions(port=free_port()))
    service.warm_up()
    try:
        stage = Stage(service, scenario)
        stage.play(0.5)
        assert stage.step() == []
    finally:
        service.close()


def test_the_service_that_holds_arms_is_imported_without_the_page() -> None:
    # After a death of the process, HOLD is away for as long as its imports take.
    program = "import sys, dashboard.service, dashboard.web.site; sys.exit('viser' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", program]).returncode == 0
