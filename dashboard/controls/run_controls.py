"""Headline of the page and buttons of the run."""

from __future__ import annotations

import viser

from dashboard import palette
from dashboard.action_queue import ActionQueue
from dashboard.controls import status_text
from dashboard.controls.status_text import StatusLine
from dashboard.outbox import Outbox
from lariat.trajectory import SECOND
from shared.messages import PAUSED, RUNNING, TaskRequest, TaskState

RUN_REQUESTS = {"Pause": TaskRequest.PAUSE, "Stop": TaskRequest.STOP}
"""Requests of the buttons below Start, by label."""
RESET_REQUESTS = {"Reset rope": TaskRequest.RESET, "Restore scenario": TaskRequest.RESTORE}
"""Requests of the buttons of a simulated cell, by label."""
NUMBERS_PERIOD = SECOND // 5
"""Least time between two headlines that differ in their numbers only [ns]."""
HEADLINE_SIZE = 1.05
"""Size of the headline's text [em]; two lines hold the state, distance and clearance."""
HEADLINE_HEIGHT = 8.4
"""Height of two such lines and two lines of detail [em]: nothing below moves when they wrap."""


class RunControls:
    """State of the cell in one line, and Start, Pause, Stop and the two resets."""

    def __init__(
        self,
        gui: viser.GuiApi,
        actions: ActionQueue,
        outbox: Outbox,
        live: bool,
        resettable: bool,
    ) -> None:
        """Add the elements to the page."""
        self.headline = gui.add_html(_headline_html(status_text.headline(None, 0.0, None)))
        """Element with the state of the cell."""
        self._shown: StatusLine | None = None
        self._shown_time = 0
        self._start = gui.add_button(
            "Start",
            icon=viser.Icon.PLAYER_PLAY,
            color=palette.GOOD,
            visible=live,
            hint="Move the rope to the goal",
        )
        self._start.on_click(
            lambda _: actions.put(lambda: outbox.request_task(TaskRequest.START, "Start"))
        )
        groups = (
            ("Run", RUN_REQUESTS, live, "Pause holds and can be continued; Stop ends the run"),
            (
                "Simulation",
                RESET_REQUESTS,
                live and resettable,
                "Reset rope returns rope and arms to the start and keeps goal and obstacles; "
                "Restore scenario returns those too",
            ),
        )
        for title, requests, visible, hint in groups:
            group = gui.add_button_group(title, tuple(requests), visible=visible, hint=hint)
            group.on_click(
                lambda event, requests=requests: actions.put(
                    lambda label=event.target.value: outbox.request_task(requests[label], label)
                )
            )

    def update(self, headline: StatusLine, task: TaskState | None, now: int) -> None:
        """Show the state of the cell.

        Args:
            headline: Line to show on top of the page.
            task: Newest state of the controller, which decides what Start does.
            now: Present time [ns].
        """
        is_due = _state(headline) != _state(self._shown) or not (
            0 <= now - self._shown_time < NUMBERS_PERIOD
        )
        if headline != self._shown and is_due:
            self._shown, self._shown_time = headline, now
            self.headline.content = _headline_html(headline)
        label = "Continue" if task is not None and task.state == PAUSED else "Start"
        if self._start.label != label:
            self._start.label = label
        disabled = task is None or task.state == RUNNING
        if self._start.disabled != disabled:
            self._start.disabled = disabled


def _state(line: StatusLine | None) -> tuple[str, str]:
    """Words of a headline before its numbers, and its detail."""
    return ("", "") if line is None else (line.text.partition(":")[0], line.detail)


def _headline_html(line: StatusLine) -> str:
    return (
        f"<div style='min-height:{HEADLINE_HEIGHT}em;font-variant-numeric:tabular-nums'>"
        f"{status_text.as_html(line, size=f'{HEADLINE_SIZE}em')}</div>"
    )
