"""Pages that a bench keeps open."""

from __future__ import annotations

import time

from benchmarks.speed.pages import OpenPages
from dashboard.options import DashboardOptions
from dashboard.service import build
from lariat.scenario import load
from shared.runtime.free_port import free_port
from tests.dashboard.stage import Stage


def test_open_page_is_drawn_at_every_second_step() -> None:
    scenario = load("three-cylinders")
    service = build(scenario, "dashboard-ab", DashboardOptions(port=free_port()))
    service.warm_up()
    stage = Stage(service, scenario)
    try:
        pages = OpenPages(service.address, 1)
        try:
            clients = service._page._server.get_clients
            deadline = time.monotonic() + 20.0
            while not clients():
                assert time.monotonic() < deadline, "the dashboard sees no browser"
                time.sleep(0.02)
            drawn = []
            for k in range(10):
                stage.play(0.1 + 0.05 * k)
                stage.step()
                drawn.append(service._page._draw_time)
            assert len(set(drawn)) == 5
        finally:
            pages.close()
    finally:
        service.close()
