"""Tab of a cell's first day: the checklist, and the question that it asks at present."""

from __future__ import annotations

import html

import viser

from dashboard import palette
from dashboard.action_queue import ActionQueue
from dashboard.outbox import Outbox
from dashboard.panels.note import note_html
from dashboard.subscriptions import STALE_AGE
from shared.messages import CommissioningState

NOT_STARTED = (
    "The checklist of a cell's first day is gone through here while "
    "`lariat commission FILE --page` runs on the machine of the stack."
)
"""Text while no checklist is gone through."""
MARKS = {"passed": "✓", "failed": "✗", "open": "○"}
"""Mark of a step by its outcome."""


class FirstDayPanel:
    """Steps with their results, and buttons for the answer to a question."""

    def __init__(self, gui: viser.GuiApi, actions: ActionQueue, outbox: Outbox) -> None:
        """Add the elements to the page.

        Args:
            gui: The page's GUI.
            actions: Queue for clicks.
            outbox: Destination of answers.
        """
        self._gui, self._actions, self._outbox = gui, actions, outbox
        self._list = gui.add_html(note_html(NOT_STARTED))
        self._shown = self._list.content
        self._answers = gui.add_folder("Answer", visible=False)
        self._buttons: list[viser.GuiButtonHandle] = []
        self._asked = ""

    def update(self, state: CommissioningState | None, age: float) -> None:
        """Draw the newest state, of an age [s]; one that is not renewed is over."""
        heard = state is not None and age < STALE_AGE
        content = checklist_html(state) if state and heard else note_html(NOT_STARTED)
        if content != self._shown:
            self._list.content = self._shown = content
        self._ask(state.question_id if state and heard else "")

    def _ask(self, question: str) -> None:
        """Offer the answers to a question by its id; empty for none.

        Each question has buttons of its own: a click on those of an earlier one answers nothing.
        """
        if question == self._asked:
            return
        self._asked = question
        for button in self._buttons:
            button.remove()
        self._buttons.clear()
        self._answers.visible = bool(question)
        if not question:
            return
        with self._answers:
            for label, yes, color in (("Yes", True, palette.GOOD), ("No", False, None)):
                button = self._gui.add_button(label, color=color)
                button.on_click(
                    lambda _, yes=yes: self._actions.put(lambda: self._answer(question, yes))
                )
                self._buttons.append(button)

    def _answer(self, question: str, yes: bool) -> None:
        if question == self._asked:
            self._outbox.answer_commissioning(question, yes)
            self._ask("")
            # The same question is not offered again while its answer is on the way.
            self._asked = question


def checklist_html(state: CommissioningState) -> str:
    """HTML of the steps, what is done at present, and the question."""
    rows = []
    for number, step in enumerate(state.steps, start=1):
        current = number == state.current and not state.ended
        mark = "▸" if current else MARKS.get(step.outcome, "")
        detail, weight = html.escape(step.detail), 600 if current else 400
        rows.append(
            f"<tr style='font-weight:{weight}'><td style='width:1.4em'>{mark}</td>"
            f"<td>{number}. {html.escape(step.title)}"
            f"<div style='opacity:.75;font-weight:400'>{detail}</div></td></tr>"
        )
    line = "The checklist has ended." if state.ended else state.line
    asked = (
        f"<p style='font-weight:600'>{html.escape(state.question)}</p>" if state.question else ""
    )
    return (
        "<div style='margin:.4em 1em;font-size:.85em'>"
        f"<table style='border-spacing:0 .25em'>{''.join(rows)}</table>"
        f"<p>{html.escape(line)}</p>{asked}</div>"
    )
