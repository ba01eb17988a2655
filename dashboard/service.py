"""The dashboard as a service: it reads nearly every topic and publishes people's requests."""

from __future__ import annotations

from collections.abc import Iterator

from dashboard import server
from dashboard.options import DashboardOptions
from dashboard.outbox import Outbox
from dashboard.page import Page
from dashboard.subscriptions import READS
from shared import topics
from shared.scenario import Scenario
from shared.service import Inbox, Publication


class DashboardService:
    """Web page that every step brings up to date."""

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
        self.outbox = Outbox(session)
        web_server = server.start(options.host, options.port, "Lariat")
        self._page = Page(web_server, scenario, self.outbox)

    def warm_up(self) -> None:
        """Do nothing: no code is compiled here."""

    def step(self, inbox: Inbox, now: int) -> Iterator[Publication]:
        """Run people's actions, draw new messages and publish requests."""
        self._page.run_actions()
        self._page.update(inbox, now)
        yield from self.outbox.take(now)

    def close(self) -> None:
        """Stop the web server."""
        self._page.close()


def build(
    scenario: Scenario, session: str, options: DashboardOptions | None = None
) -> DashboardService:
    """Build the dashboard of a scenario.

    Raises:
        ConfigurationError: The port is taken.
    """
    return DashboardService(scenario, session, options or DashboardOptions())
