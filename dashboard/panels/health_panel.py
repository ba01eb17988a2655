"""Health of the services and state of the recorder."""

from __future__ import annotations

import viser

from dashboard.panels import health_table, topic_ages
from dashboard.subscriptions import HEALTHS, SERVICES, latest_with_age
from lariat.trajectory import SECOND
from shared import topics
from shared.runtime.service import Inbox

UPDATE_PERIOD = SECOND // 2
"""Time between two updates of the panel [ns]."""


class HealthPanel:
    """Tables of the services and of the topics, and a line about the recorder."""

    def __init__(self, gui: viser.GuiApi) -> None:
        self._table = gui.add_html("")
        self._recorder = gui.add_html("")
        self._ages = gui.add_html("")
        self._update_time = 0

    def clear(self) -> None:
        """Make the next `update` draw, for a jump in a recording."""
        self._update_time = 0

    def update(self, inbox: Inbox, now: int) -> None:
        """Draw the newest messages, at most every `UPDATE_PERIOD`."""
        if now - self._update_time < UPDATE_PERIOD:
            return
        self._update_time = now
        health = {}
        for name, topic in HEALTHS.items():
            message, age = latest_with_age(inbox, topic, now)
            if message is not None:
                health[name] = (message, age)
        stack, _ = latest_with_age(inbox, topics.STACK_STATE, now)
        record, _ = latest_with_age(inbox, topics.RUN_RECORD, now)
        self._table.content = health_table.table_html(SERVICES, health, stack)
        self._recorder.content = health_table.recorder_html(record)
        self._ages.content = topic_ages.ages_html(health)
