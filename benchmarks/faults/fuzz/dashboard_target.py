"""Dashboard under hostile messages, drawn by an open page."""

from __future__ import annotations

import socket
import time
from collections.abc import Sequence

from benchmarks.faults.fuzz.message_targets import ServiceTarget, Totals
from benchmarks.speed.pages import OpenPages
from dashboard.options import DashboardOptions
from dashboard.service import build
from lariat.scenario import Scenario
from shared.runtime.service import Service
from stack.simulation.simulated_time import Delivery

CLOSING_TIME = 0.2
"""Time after a batch in which a connection that has failed is noticed to have ended [s]."""


class DashboardTarget(ServiceTarget):
    """Dashboard that draws what passes the check, on a free port of 127.0.0.1.

    A failure is an exception of a step, or the end of the page's connection.
    """

    def __init__(self, scenario: Scenario, lawful: Sequence[Delivery]) -> None:
        """Start a dashboard and open its page."""
        self._pages: OpenPages | None = None
        super().__init__("dashboard", scenario, lawful)

    def run_batch(self, seed: str, count: int, totals: Totals) -> None:
        """Send hostile messages to the dashboard, and step it."""
        super().run_batch(seed, count, totals)
        time.sleep(CLOSING_TIME)
        if self._pages and self._pages.closed:
            totals.failures.append(f"dashboard {seed}: the page has ended {self._pages.reason}")
            self._build()

    def close(self) -> None:
        """Close page and dashboard."""
        if self._pages:
            self._pages.close()
        super().close()

    def _create(self, scenario: Scenario) -> Service:
        if self._pages:
            # The former dashboard has failed.
            self.close()
        with socket.socket() as probe:
            probe.bind(("127.0.0.1", 0))
            port = probe.getsockname()[1]
        service = build(scenario, "dashboard-0", DashboardOptions(port=port))
        self._pages = OpenPages(service.address, 1)
        return service
