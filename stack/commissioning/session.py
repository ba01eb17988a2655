"""What a step of the checklist works with: the cell's file, the running stack, and a person."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

from lariat.scenario import Scenario, Shape
from shared.messages import ArmCommand, ArmStates, TaskRequest, TaskState
from shared.topics import Topic


class NotPassed(Exception):
    """A step has not passed; the text says what was found and what to do."""


class Operator(Protocol):
    """Person at the cell."""

    approach_button: str
    """Name of what the person holds down during an approach."""

    def begin(self, number: int) -> None:
        """Take note of the step that begins, by its number from 1; 0: all are over."""
        ...

    def tell(self, text: str) -> None:
        """Show a line."""
        ...

    def agree(self, question: str) -> bool:
        """Ask a question; only an explicit yes is True."""
        ...

    def approach(self, link: CellLink, shown: ArmStates) -> str:
        """Let the arms go to the start while the person holds a key.

        Returns:
            What ended the approach, in words; empty when the arms are at the start.
        """
        ...


class CellLink(Protocol):
    """Running stack of the cell."""

    def latest(self, topic: Topic) -> Any | None:
        """Return the newest message of a topic; None before the first one."""
        ...

    def observe(self, until: Callable[[ArmStates], bool], seconds: float) -> list[ArmStates]:
        """Let time pass, and return the states of the arms that came.

        Args:
            until: Ends the observation with the first state for which it is true.
            seconds: Longest duration [s].
        """
        ...

    def command(self, action: ArmCommand.Action) -> ArmStates:
        """Command the arms, and return their answer.

        Raises:
            RequestFailed: The gateway refused, or did not answer.
        """
        ...

    def request(self, action: TaskRequest.Action) -> TaskState:
        """Send a request to the controller, and return its answer.

        Raises:
            RequestFailed: The controller refused, or did not answer.
        """
        ...

    def set_goal(self, shape: Shape) -> None:
        """Set a shape of the scenario as the goal.

        Raises:
            RequestFailed: The controller refused, or did not answer.
        """
        ...


@dataclass(frozen=True)
class Session:
    """One session of commissioning."""

    scenario: Scenario
    """The cell's file."""
    link: CellLink
    """The running stack."""
    operator: Operator
    """Person at the cell."""

    def confirm(self, question: str, otherwise: str) -> None:
        """Ask a person.

        Raises:
            NotPassed: The person does not agree.
        """
        if not self.operator.agree(question):
            raise NotPassed(otherwise)

    def agree_to_motion(self, what: str) -> None:
        """Ask for the consent to one motion, which begins at once.

        Raises:
            NotPassed: The person does not agree; nothing has moved.
        """
        self.confirm(
            f"{what} A hand on the emergency stop, nobody within reach. Now?",
            "not agreed to; nothing has moved",
        )
