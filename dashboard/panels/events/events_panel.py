"""Tab of events, with a least level and words to look for."""

from __future__ import annotations

import viser

from dashboard.action_queue import ActionQueue
from dashboard.panels.events.event_list import LEVELS, EventList, Level, list_html
from dashboard.subscriptions import LOGS
from lariat.trajectory import SECOND
from shared import topics
from shared.runtime.service import Inbox

UPDATE_PERIOD = SECOND // 2
"""Time between two drawings [ns]."""


class EventsPanel:
    """List of events and its filter."""

    def __init__(self, gui: viser.GuiApi, actions: ActionQueue) -> None:
        self._events = EventList()
        self._level, self._words = Level.INFORMATION, ""
        self._drawn: tuple[int, Level, str] | None = None
        self._draw_time = 0
        # A list shows what is chosen; a group of buttons would not.
        choice = gui.add_dropdown("Level", tuple(LEVELS), hint="Least weight of the events")
        actions.on_change(choice, self._choose)
        words = gui.add_text("Find", "", hint="Words of an event, or the name of a service")
        actions.on_change(words, self._find)
        self._list = gui.add_html(list_html(()))

    def clear(self) -> None:
        """Drop all events, for a jump in a recording."""
        self._events.clear()
        self._drawn, self._draw_time = None, 0

    def take(self, inbox: Inbox) -> None:
        """Take what arrived since the last step."""
        for topic in LOGS:
            for item in inbox.every(topic):
                self._events.take_log(item.message)
        for item in inbox.every(topics.ARM_STATE):
            self._events.take_arms(item.message)
        for item in inbox.every(topics.TASK_STATE):
            self._events.take_task(item.message)

    def draw(self, now: int) -> None:
        """Draw the list if it has changed, at most every `UPDATE_PERIOD`."""
        state = self._events.revision, self._level, self._words
        if state == self._drawn or now - self._draw_time < UPDATE_PERIOD:
            return
        self._drawn, self._draw_time = state, now
        self._list.content = list_html(self._events.selected(self._level, self._words))

    def _choose(self, name: str) -> None:
        self._level = LEVELS[name]

    def _find(self, text: str) -> None:
        self._words = text
