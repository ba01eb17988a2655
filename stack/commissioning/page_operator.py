"""Person at the page: sees the checklist in a tab, answers its questions, holds its button."""

from __future__ import annotations

import time
from collections.abc import Callable

from lariat.scenario import Scenario
from lariat.trajectory import SECOND
from shared import topics
from shared.messages import ArmStates, CommissioningState, CommissioningStep
from stack.client import POLL_PERIOD, Client
from stack.commissioning.checklist import STEPS
from stack.commissioning.record import CommissioningRecord, fingerprint
from stack.commissioning.session import CellLink, NotPassed

PUBLICATION_PERIOD = SECOND // 2
"""Time between two publications of an unchanged checklist [ns]."""
ANSWER_TIMEOUT = 1800.0
"""Longest wait for an answer [s]."""
APPROACH_TIMEOUT = 600.0
"""Longest duration of an approach, with the time until the button is pressed [s]."""


class PageOperator:
    """Publishes the checklist for the page, and takes the answers of who has its controls."""

    approach_button = "the button of the approach in the bar at the lower edge of the page"

    def __init__(
        self,
        client: Client,
        scenario: Scenario,
        record: CommissioningRecord,
        echo: Callable[[str], None],
    ) -> None:
        """
        Args:
            client: Client of the running stack.
            scenario: The cell.
            record: Results of the steps.
            echo: Called with every line, for a log.
        """
        self._client, self._scenario, self._record, self._echo = client, scenario, record, echo
        self._publisher = client.bus.publisher(topics.COMMISSIONING_STATE)
        self._answers = client.bus.subscribe(topics.COMMISSIONING_ANSWER)
        self._former = dict(record.results)
        self._current, self._line, self._published = 0, "", 0
        self._question = self._question_id = ""

    def begin(self, number: int) -> None:
        self._current = number
        self._publish()

    def tell(self, text: str) -> None:
        self._echo(text)
        self._line = text.strip()
        self._publish()

    def agree(self, question: str) -> bool:
        self._echo(f"  asked on the page: {question}")
        self._answers.take()  # What came before does not answer it.
        self._question, self._question_id = question, self._client.next_id()
        self._publish()
        try:
            return self._awaited_answer()
        finally:
            self._question = self._question_id = ""
            self._publish()

    def approach(self, link: CellLink, shown: ArmStates) -> str:
        begun = False

        def over(state: ArmStates) -> bool:
            nonlocal begun
            begun |= state.approaching
            # While the arms go, they may move. Let go on their way, they wait for another approach.
            return not state.approaching and (state.may_move or state.needs_acknowledgement)

        self.tell(
            f"Hold {self.approach_button} down; the arms stop when it is released, and go on when "
            "it is held again."
        )
        states = link.observe(over, APPROACH_TIMEOUT)
        if states and over(states[-1]) and states[-1].may_move:
            return ""
        stopped = begun or bool(states and states[-1].needs_acknowledgement)
        return states[-1].reason if stopped else "nobody has held the button"

    def publish_if_due(self) -> None:
        """Publish the checklist again once a while."""
        if self._client.now() - self._published >= PUBLICATION_PERIOD:
            self._publish()

    def close(self) -> None:
        """Say that the checklist has ended."""
        self._publish(ended=True)

    def _awaited_answer(self) -> bool:
        deadline = time.monotonic() + ANSWER_TIMEOUT
        while time.monotonic() < deadline:
            self.publish_if_due()
            for _, item in self._answers.take():
                if item.message.question_id == self._question_id:
                    self._echo(f"  answered: {'yes' if item.message.yes else 'no'}")
                    return item.message.yes
            time.sleep(POLL_PERIOD)
        raise NotPassed(f"nobody has answered on the page for {ANSWER_TIMEOUT / 60.0:.0f} min")

    def _publish(self, ended: bool = False) -> None:
        self._published = self._client.now()
        self._publisher.put(
            CommissioningState(
                stamp=self._published,
                steps=[self._step(k) for k in range(len(STEPS))],
                current=self._current,
                line=self._line,
                question=self._question,
                question_id=self._question_id,
                ended=ended,
            )
        )

    def _step(self, index: int) -> CommissioningStep:
        step = STEPS[index]
        result = self._record.results.get(step.name)
        settings = fingerprint(self._scenario, step.settings)
        # A result of other settings, or of a step that is to be repeated, counts for nothing.
        repeated = not step.lasting and result is self._former.get(step.name) and self._current
        if result is None or result.settings != settings or repeated:
            return CommissioningStep(title=step.title)
        return CommissioningStep(
            title=step.title, outcome=result.outcome, detail=result.detail, when=result.when
        )
