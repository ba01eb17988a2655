"""Tab of the first day: the checklist as it is published, and answers to its question."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from dashboard.action_queue import ActionQueue
from dashboard.outbox import Outbox
from dashboard.panels.first_day_panel import FirstDayPanel, list_html, present_html
from dashboard.web.private_viser import PrivateViser
from shared import topics
from shared.messages import CommissioningState, CommissioningStep

STEPS = [
    CommissioningStep(title="Power", outcome="passed", detail="armed <ready>"),
    CommissioningStep(title="Stop in motion"),
]


def state(question: str = "", number: int = 1) -> CommissioningState:
    return CommissioningState(
        steps=STEPS,
        current=2,
        line="2/2 Stop in motion …",
        question=question,
        question_id=f"lariat-{number}" if question else "",
    )


class Shown:
    """The panel, and what it sends."""

    def __init__(self, private: PrivateViser) -> None:
        self.actions, self.outbox = ActionQueue(), Outbox("page")
        self.panel = FirstDayPanel(private.server.gui, self.actions, self.outbox)

    def click(self, label: str) -> list[tuple[str, bool]]:
        """Answers that a click sends: question and whether it is a yes."""
        (button,) = [b for b in self.panel._buttons if b.label == label]
        for callback in button._impl.update_cb:
            callback(None)  # pyright: ignore[reportArgumentType]
        self.actions.run()
        sent = [p for p in self.outbox.take(1) if p.topic.key == topics.COMMISSIONING_ANSWER.key]
        return [(p.message.question_id, p.message.yes) for p in sent]


@pytest.fixture
def shown() -> Iterator[Shown]:
    private = PrivateViser("test")
    yield Shown(private)
    private.close()


def test_steps_results_and_the_question_are_drawn_as_text() -> None:
    steps = list_html(state(), heard=True)
    assert "armed &lt;ready&gt;" in steps
    assert "✓" in steps
    assert "▸" in steps
    asked = present_html(state("Does it agree with `lariat <status>`?"), heard=True)
    assert "Does it agree with <code>lariat &lt;status&gt;</code>?" in asked


def test_a_question_and_its_answers_stand_above_the_list(shown: Shown) -> None:
    panel = shown.panel
    assert panel._present.order < panel._answers.order < panel._list.order


def test_without_a_question_nothing_can_be_answered(shown: Shown) -> None:
    shown.panel.update(state(), 0.1)
    assert not shown.panel._buttons
    assert not shown.panel._answers.visible


def test_an_answer_is_that_to_the_question_shown_and_is_given_once(shown: Shown) -> None:
    shown.panel.update(state("May it move?", 4), 0.1)
    assert shown.click("Yes") == [("lariat-4", True)]
    shown.panel.update(state("May it move?", 4), 0.1)
    assert not shown.panel._buttons
    shown.panel.update(state("And back?", 5), 0.1)
    assert shown.click("No") == [("lariat-5", False)]


def test_a_checklist_that_is_not_renewed_asks_nothing(shown: Shown) -> None:
    shown.panel.update(state("May it move?"), 0.1)
    shown.panel.update(state("May it move?"), 10.0)
    assert not shown.panel._buttons
    present, steps = shown.panel._shown
    assert "May it move?" not in present
    assert "lariat commission FILE --page" in present
    assert "armed &lt;ready&gt;" in steps


def test_a_checklist_that_has_ended_stays_to_be_read(shown: Shown) -> None:
    over = state()
    over.ended = True
    shown.panel.update(over, 600.0)
    present, steps = shown.panel._shown
    assert "The checklist has ended." in present
    assert "armed &lt;ready&gt;" in steps
