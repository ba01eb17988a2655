"""The dashboard as a service: it reads nearly every topic and publishes people's requests."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from dashboard.controls.first_steps import FirstSteps
from dashboard.controls.hold_path import HoldPath
from dashboard.controls.stop_bar import StopBar
from dashboard.options import DashboardOptions
from dashboard.outbox import Outbox
from dashboard.subscriptions import READS, latest_with_age, reads, silence, unheard
from dashboard.web.site import Site
from lariat.arms.description import with_own_urdfs
from lariat.scenario import Scenario
from shared import topics
from shared.door import Door
from shared.runtime.service import Inbox, Publication
from shared.topics import Topic

if TYPE_CHECKING:
    from dashboard.page import Page


class DashboardService:
    """Web page that every step brings up to date; its HOLD works before the page is built."""

    name = "dashboard"
    reads: Sequence[Topic] = (topics.CAMERA_COLOR, topics.CAMERA_CALIBRATION, *READS)
    writes: Sequence[Topic] = (
        topics.TASK_REQUEST,
        topics.TASK_GOAL_DRAFT,
        topics.SCENE_REQUEST,
        topics.ARM_COMMAND,
        topics.ARM_CONSENT,
        topics.RUN_LIST_REQUEST,
        topics.GOAL_LIST_REQUEST,
        topics.STACK_REQUEST,
    )
    rate = 30.0
    latency = 0.0

    address: str
    """Address that a person opens; on this machine it holds the token of this start."""

    def __init__(self, scenario: Scenario, session: str, options: DashboardOptions) -> None:
        self.reads = reads(scenario)
        self.outbox = Outbox(session)
        self.reflex = HoldPath(session)
        self._stop_bar = StopBar(self.outbox, self.reflex)
        self._first_steps = FirstSteps(scenario.simulated)
        self._site = Site(options, f"{scenario.name} · Lariat", self._stop_bar)
        self.address = self._site.address
        self._scenario = scenario
        self._page: Page | None = None
        self.door = Door()
        # Whoever names the file of the token says where the page is.
        self.greeting = "" if options.token_file else f"dashboard at {self.address}"

    def warm_up(self) -> None:
        """Build the page."""
        # Its import takes longer than HOLD may be away after the death of the process.
        from dashboard.page import Page

        self._page = Page(self._site.open_viser(), self._scenario, self.outbox)

    def step(self, inbox: Inbox, now: int) -> Iterator[Publication]:
        """Run people's actions, draw new messages and publish requests."""
        assert self._page is not None, "a service is warmed up before its first step"
        self._page.actions.run()
        arms, age = latest_with_age(inbox, topics.ARM_STATE, now)
        task, _ = latest_with_age(inbox, topics.TASK_STATE, now)
        stack, _ = latest_with_age(inbox, topics.STACK_STATE, now)
        status = self._stop_bar.step(
            arms,
            age,
            now,
            silence(inbox, now),
            self._first_steps.update(task, arms, unheard(inbox)),
            stack.activity if stack is not None else "",
        )
        if status is not None:
            self._site.show_status(status)
        with self.door.guard("what the page shows"):
            self._page.update(inbox, now)
        yield from self.outbox.take(now)

    def close(self) -> None:
        """Stop the web server."""
        if self._page is not None:
            self._page.close()
        self._site.close()


def build(
    scenario: Scenario, session: str, options: DashboardOptions | None = None
) -> DashboardService:
    """Build the dashboard of a scenario."""
    return DashboardService(with_own_urdfs(scenario), session, options or DashboardOptions())
