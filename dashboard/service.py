"""The dashboard as a service: it reads nearly everything and publishes what people ask for."""

from __future__ import annotations

from collections.abc import Iterator

from dashboard import server
from dashboard.options import DashboardOptions
from dashboard.outbox import Outbox
from dashboard.page import READS, Page
from shared import topics
from shared.scenario import Scenario
from shared.service import Inbox, Publication


class DashboardService:
    """One page, brought up to date with every step."""

    name = "dashboard"
    reads = READS
    writes = (
        topics.TASK_REQUEST,
        topics.TASK_GOAL_DRAFT,
        topics.SCENE_REQUEST,
        topics.ARM_COMMAND,
    )
    rate = 30.0
    latency = 0.0

    def __init__(self, scenario: Scenario, session: str, options: DashboardOptions) -> None:
        self._outbox = Outbox(session)
        web = server.start(options.host, options.port, "Lariat")
        self._page = Page(web, scenario, self._outbox)

    def warm_up(self) -> None:
        """Nothing compiles here."""

    def step(self, inbox: Inbox, now: int) -> Iterator[Publication]:
        """Shows what came, does what people asked for."""
        self._page.act()
        self._page.show(inbox, now)
        yield from self._outbox.take(now)

    def close(self) -> None:
        """Ends the server."""
        self._page.close()


def build(
    scenario: Scenario, session: str, options: DashboardOptions | None = None
) -> DashboardService:
    """The dashboard of a scenario's cell.

    Raises:
        ConfigurationError: The port is taken.
    """
    return DashboardService(scenario, session, options or DashboardOptions())
