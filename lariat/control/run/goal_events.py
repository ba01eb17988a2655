"""Goals that a scenario sets while a run is under way: at given times, or one after the other."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from lariat.control.run.reasons import ReasonCode
from lariat.control.run.state_machine import RunEvent, RunState
from lariat.control.run.task import Task
from lariat.scenario import Goal, Shape
from lariat.scenario.sections import Event
from lariat.trajectory import SECOND


class GoalEvents:
    """Events of a scenario that change the goal, and goals that follow each other."""

    def __init__(self, events: Sequence[Event], next_goals: Sequence[Shape] = ()) -> None:
        """Select the events that name a goal.

        Args:
            events: All events of the scenario.
            next_goals: Goals after the first one, each for when the one before it is reached.
        """
        self._next_goals = next_goals
        self._reached = 0
        named = [(event.time, event.goal) for event in events if event.goal is not None]
        self._events = sorted(named, key=lambda event: event[0])
        self._done = 0

    def restart(self) -> None:
        """Begin a run: all events and goals are ahead."""
        self._done = self._reached = 0

    def apply_reached(self, task: Task, goal_from: Callable[[Shape], Goal]) -> bool:
        """Set the next goal where the present one is reached.

        Args:
            task: Task whose goal changes.
            goal_from: Maker of a goal from a scenario's section.

        Returns:
            Whether another goal has been set.
        """
        if task.state is not RunState.REACHED or self._reached == len(self._next_goals):
            return False
        shape = self._next_goals[self._reached]
        self._reached += 1
        task.set_goal(goal_from(shape))
        count = len(self._next_goals) + 1
        task.apply(RunEvent.GOAL_EVENT, ReasonCode.NEXT_GOAL, number=self._reached + 1, count=count)
        return True

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
