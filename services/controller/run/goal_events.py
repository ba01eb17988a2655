"""Goals that a scenario's events set while a run is under way."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from services.controller.run.reasons import ReasonCode
from services.controller.run.state_machine import RunEvent
from services.controller.run.task import Goal, Task
from shared.scenario import Shape
from shared.scenario.sections import Event
from shared.service import SECOND


class GoalEvents:
    """Events of a scenario that change the goal, in their order in time."""

    def __init__(self, events: Sequence[Event]) -> None:
        """Select the events that name a goal.

        Args:
            events: All events of the scenario.
        """
        named = [(event.time, event.goal) for event in events if event.goal is not None]
        self._events = sorted(named, key=lambda event: event[0])
        self._done = 0

    def restart(self) -> None:
        """Begin a run: all events are ahead."""
        self._done = 0

    def apply_due(self, now: int, task: Task, goal_from: Callable[[Shape], Goal]) -> None:
        """Set the goals that are due.

        Args:
            now: Present time [ns].
            task: Task whose goal changes.
            goal_from: Maker of a goal from a scenario's section.
        """
        if not task.active:
            return
        for time, shape in self._events[self._done :]:
            if now < task.run_started + round(time * SECOND):
                return
            self._done += 1
            task.set_goal(goal_from(shape))
            task.apply(RunEvent.GOAL_EVENT, ReasonCode.SCHEDULED_GOAL, seconds=time)
