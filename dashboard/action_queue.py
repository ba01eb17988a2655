"""Queue that carries actions from the web server's threads into the thread that steps.

Callbacks of the web server only call `put`; every action runs in the thread that steps.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterable
from functools import partial
from queue import Empty, SimpleQueue
from typing import TYPE_CHECKING, Any

from dashboard import palette

if TYPE_CHECKING:
    import viser

log = logging.getLogger(__name__)

Action = Callable[[], object]


class ActionQueue:
    """First-in, first-out queue of actions; `put` may be called in any thread."""

    def __init__(self) -> None:
        self._queue: SimpleQueue[Action] = SimpleQueue()

    def put(self, action: Action) -> None:
        """Append an action."""
        self._queue.put(action)

    def on_change(self, element: Any, take: Callable[[Any], object]) -> None:
        """Take each value that a person gives an element of the page, none that the page sets."""
        element.on_update(
            lambda event: event.client is not None and self.put(partial(take, event.target.value))
        )

    def on_press(
        self, button: viser.GuiButtonHandle, act: Callable[[viser.ClientHandle], object]
    ) -> None:
        """Act on each press of a button, with the window in which it was pressed."""
        button.on_click(
            lambda event: event.client is not None and self.put(partial(act, event.client))
        )

    def confirm(
        self,
        client: viser.ClientHandle,
        question: str,
        paragraphs: Iterable[str],
        word: str,
        action: Action,
        otherwise: str = "Keep",
        color: palette.Color = palette.BAD,
    ) -> None:
        """Ask in one window, with paragraphs of HTML, and act once the word's button is pressed."""
        modal = client.gui.add_modal(question)
        with modal:
            for paragraph in paragraphs:
                client.gui.add_html(paragraph)
            act = client.gui.add_button(word, color=color)
            leave = client.gui.add_button(otherwise, color=palette.NEUTRAL)
        act.on_click(lambda _: self.put(action))
        for button in (act, leave):
            button.on_click(lambda _: modal.close())

    def run(self) -> None:
        """Remove and run the actions that are queued now, oldest first.

        One that fails is logged and dropped: its arguments come from a browser, and no browser may
        end the process.
        """
        for _ in range(self._queue.qsize()):
            try:
                action = self._queue.get_nowait()
            except Empty:
                return
            try:
                action()
            except Exception:
                log.exception("an action of the page failed")
