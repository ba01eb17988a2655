"""Headline of the page and buttons of the run."""

from __future__ import annotations

import viser

from dashboard import palette
from dashboard.action_queue import ActionQueue
from dashboard.controls import status_text
from dashboard.controls.status_text import StatusLine
from dashboard.outbox import Outbox
from shared.messages import PAUSED, RUNNING, TaskRequest, TaskState

REQUESTS = {
    "Pause": TaskRequest.PAUSE,
    "Stop": TaskRequest.STOP,
    "Reset": TaskRequest.RESET,
}
"""Requests of the buttons beside Start, by label."""


class RunControls:
    """State of the cell in one line, and Start, Pause, Stop and Reset."""

    def __init__(
        self,
        gui: viser.GuiApi,
        actions: ActionQueue,
        outbox: Outbox,
        live: bool,
        resettable: bool,
    ) -> None:
        """Add the elements to the page.

        Args:
            gui: The page's GUI.
            actions: Queue for clicks.
            outbox: Destination of requests.
            live: Whether there is a cell to control; a recording has no buttons.
            resettable: Whether the whole cell is simulated, so that it can return to its start.
        """
        self._headline = gui.add_html(status_text.as_html(status_text.headline(None, 0.0, None)))
        self._shown: StatusLine | None = None
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
        labels = tuple(label for label in REQUESTS if resettable or label != "Reset")
        group = gui.add_button_group(
            "Run",
            labels,
            visible=live,
            hint="Pause holds and can be continued; Stop ends the run; Reset returns to the start",
        )
        group.on_click(
            lambda event: actions.put(
                lambda label=event.target.value: outbox.request_task(REQUESTS[label], label)
            )
        )

    def update(self, headline: StatusLine, task: TaskState | None) -> None:
        """Show the state of the cell.

        Args:
            headline: Line to show on top of the page.
            task: Newest state of the controller, which decides what Start does.
        """
        if headline != self._shown:
            self._shown = headline
            self._headline.content = status_text.as_html(headline, size="1.15em")
        label = "Continue" if task is not None and task.state == PAUSED else "Start"
        if self._start.label != label:
            self._start.label = label
        disabled = task is None or task.state == RUNNING
        if self._start.disabled != disabled:
            self._start.disabled = disabled
