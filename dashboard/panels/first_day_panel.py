"""Tab of a cell's first day: the checklist, and the question that it asks at present."""

from __future__ import annotations

import html

import viser

from dashboard import palette
from dashboard.action_queue import ActionQueue
from dashboard.outbox import Outbox
from dashboard.panels.note import note_html, text_html
from dashboard.subscriptions import STALE_AGE
from shared.messages import CommissioningState

NOT_STARTED = (
    "The checklist of a cell's first day is gone through here while "
    "`lariat commission FILE --page` runs on the machine of the stack."
)
"""Text before the first checklist."""
NOT_HEARD = "Nothing is heard of it any more; run `lariat commission FILE --page` again to go on."
"""Line of a checklist that has stopped without an end."""
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
        # What a person is asked stands above the list, where it needs no scrolling.
        self._present = gui.add_html(note_html(NOT_STARTED))
        self._answers = gui.add_folder("Answer", visible=False)
        self._list = gui.add_html("")
        self._shown = (self._present.content, self._list.content)
        self._buttons: list[viser.GuiButtonHandle] = []
        self._asked = ""

    def update(self, state: CommissioningState | None, age: float) -> None:
        """Draw the newest state, of an age [s]; one that is not renewed asks nothing."""
        heard = state is not None and (state.ended or age < STALE_AGE)
        if state is not None:
            shown = present_html(state, heard), list_html(state, heard)
            if shown != self._shown:
                self._present.content, self._list.content = self._shown = shown
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


def present_html(state: CommissioningState, heard: bool) -> str:
    """HTML of what is done or asked at present.

    Args:
        state: The checklist.
        heard: Whether it goes on, or has said that it has ended.
    """
    line = "The checklist has ended." if state.ended else state.line if heard else NOT_HEARD
    question = text_html(state.question) if heard else ""
    asked = f"<p style='font-weight:600'>{question}</p>" if question else ""
    return f"<div style='margin:.4em 1em;font-size:.85em'><p>{text_html(line)}</p>{asked}</div>"


def list_html(state: CommissioningState, heard: bool) -> str:
    """HTML of the steps with their results.

    Args:
        state: The checklist.
        heard: Whether it goes on, or has said that it has ended.
    """
    rows = []
    for number, step in enumerate(state.steps, start=1):
        current = number == state.current and heard and not state.ended
        mark = "▸" if current else MARKS.get(step.outcome, "")
        detail, weight = text_html(step.detail), 600 if current else 400
        rows.append(
            f"<tr style='font-weight:{weight}'><td style='width:1.4em'>{mark}</td>"
            f"<td>{number}. {html.escape(step.title)}"
            f"<div style='opacity:.75;font-weight:400'>{detail}</div></td></tr>"
        )
    return (
        "<div style='margin:.4em 1em;font-size:.85em'>"
        f"<table style='border-spacing:0 .25em'>{''.join(rows)}</table></div>"
    )
