"""First steps of a person at the page: which of them are done, and what the next one needs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from shared.messages import PAUSED, RUNNING, ArmStates, TaskState


class FirstStep(NamedTuple):
    """Line of the guide."""

    text: str
    """What to do."""
    done: bool
    """Whether it has been done since the start of the page."""
    hint: str
    """How to do it, or what is missing."""


class FirstSteps:
    """Follows what people do with the cell, by the states that its services publish."""

    def __init__(self, simulated: bool) -> None:
        self._simulated = simulated
        self._heard = self._armed = self._started = self._held = self._resumed = False
        self._goal_revision: int | None = None
        self._goal_set = False

    def update(
        self, task: TaskState | None, arms: ArmStates | None, missing: Sequence[str]
    ) -> list[FirstStep]:
        """Take the newest states and the services never heard of; return the steps in order."""
        self._heard |= not missing and task is not None and arms is not None
        if arms is not None:
            stopped = arms.needs_acknowledgement or arms.needs_resume
            self._resumed |= self._held and not stopped and arms.mode != ArmStates.DISARMED
            self._held |= stopped and self._started
            self._armed |= arms.mode in (ArmStates.ARMED, ArmStates.MOVING) or arms.may_move
        if task is not None:
            self._started |= task.state in (RUNNING, PAUSED) or bool(task.run_started)
            if self._goal_revision is None and task.goal.positions:
                self._goal_revision = task.goal_revision
            elif self._goal_revision is not None and task.goal_revision > self._goal_revision:
                self._goal_set = True
        if missing:
            names = ", ".join(name.replace("_", " ") for name in missing)
            cell = f"Not heard yet: {names}. lariat up starts them all."
        else:
            cell = "All services answer."
        return [
            FirstStep("The cell is there", self._heard, cell),
            FirstStep("Arm the arms", self._armed, "Press Arm."),
            FirstStep("Start the run", self._started, "Press Start: the rope goes to its goal."),
            FirstStep(
                "Set another goal",
                self._goal_set,
                "Press Edit goal, drag an end, press Set goal: the rope follows.",
            ),
            FirstStep("Hold the arms", self._held, "Press HOLD, Space or Esc at any time."),
            FirstStep(
                "Go on",
                self._resumed,
                "Press Continue." if self._simulated else "Press Acknowledge, then Resume arms.",
            ),
        ]
