"""What of a goal counts: the whole rope, a stretch of it, or its two ends; the rest is free."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import viser
from jaxtyping import Bool, Float64

from dashboard.action_queue import ActionQueue
from lariat.geometry import polylines
from lariat.scenario.checks import MAX_PART
from lariat.scenario.sections import MIN_PART_NODES, Goal, Rope

FIELD_STEP = 0.5
"""Step of the fields [mm]; it also decides how many decimals they show."""
EQUAL = 1e-6
"""Difference below which a distance is the rope's end [m]."""


class CountedStretch:
    """Switch for the ends alone, and fields of where a stretch begins and ends; hidden at first."""

    def __init__(
        self,
        gui: viser.GuiApi,
        rope: Rope,
        actions: ActionQueue,
        when_changed: Callable[[], None],
    ) -> None:
        self._rope = rope
        self._when_changed = when_changed
        self._visible = False
        self._ends = (0.0, rope.length)
        self.ends_only = False
        """Whether the poses of both ends are the whole goal."""
        self._switch = gui.add_checkbox(
            "Only the ends count",
            False,
            visible=False,
            hint="The goal is where both ends are held; the shape between them is free.",
        )
        actions.on_change(self._switch, self._take_switch)
        length = 1e3 * rope.length
        self._field = gui.add_vector2(
            "Counts [mm]",
            (0.0, length),
            min=(0.0, 0.0),
            max=(length, length),
            step=FIELD_STEP,
            visible=False,
            hint="Stretch that must come to the goal: from and to, along the rope from its left "
            "end. The rest of the rope is free.",
        )
        actions.on_change(
            self._field, lambda ends: self._take(*(1e-3 * float(end) for end in ends))
        )

    def show(self, visible: bool) -> None:
        """Show or hide switch and fields."""
        self._visible = self._switch.visible = visible
        self._field.visible = visible and not self.ends_only
        if visible:
            self._switch.value = self.ends_only
            self._field.value = (1e3 * self._ends[0], 1e3 * self._ends[1])

    def take_goal(self, goal: Goal) -> None:
        """Take what counts of a goal."""
        self.ends_only = goal.ends_only
        self._ends = goal.part or (0.0, self._rope.length)

    def applied(self, goal: Goal) -> Goal:
        """Return a goal, whose whole shape counts, with only this counting."""
        goal = replace(goal, ends_only=self.ends_only, part=self.part)
        if self.part:
            # Its grips are those of one shape of many whose stretch is this.
            goal = replace(goal, left_oriented=False, right_oriented=False)
        return goal

    def _take_switch(self, ends_only: bool) -> None:
        self.ends_only = ends_only is True
        self._field.visible = self._visible and not self.ends_only
        self._when_changed()

    def _take(self, begin: float, end: float) -> None:
        self._ends = begin, end
        self._when_changed()

    @property
    def has_shape(self) -> bool:
        """Whether the shape of the rope, or of a stretch of it, counts."""
        return not self.ends_only

    @property
    def part(self) -> tuple[float, float] | None:
        """Distances of its ends from the rope's left end [m]; None where there is no stretch."""
        if self.ends_only:
            return None
        begin, end = self._ends
        whole = begin <= EQUAL and end >= self._rope.length - EQUAL
        return None if whole else (begin, end)

    def counted(self, nodes: Float64[np.ndarray, "n 3"]) -> Bool[np.ndarray, "n"]:
        """Return which nodes of a shape count."""
        if self.ends_only and len(nodes):
            return polylines.ends_of(len(nodes))
        if self.part is None or self.problem:
            return np.ones(len(nodes), dtype=bool)
        return polylines.within(nodes, *self.part)

    @property
    def problem(self) -> str:
        """Why this is no stretch of the rope, and what to do; empty where it is one."""
        if self.ends_only:
            return ""
        begin, end = self._ends
        length, count = self._rope.length, self._rope.node_count
        # A comparison with a number that is none is false.
        if not (begin >= 0.0 and end <= length + EQUAL):
            return f"What counts lies between 0 and {1e3 * length:g} mm of the rope."
        if not begin < end:
            return "What counts ends before it begins; exchange the two numbers."
        if self.part is not None and end - begin > MAX_PART * length + EQUAL:
            return (
                f"What counts is more than {100.0 * MAX_PART:g} % of the rope; give at most "
                f"{1e3 * MAX_PART * length:g} mm, or all of it: 0 and {1e3 * length:g} mm."
            )
        at = np.linspace(0.0, length, count)
        node_count = int(np.sum((at >= begin - EQUAL) & (at <= end + EQUAL)))
        if node_count < MIN_PART_NODES:
            least = 1e3 * length / (count - 1) * MIN_PART_NODES
            return (
                f"What counts holds {node_count} of the rope's nodes, which make no shape; give at "
                f"least {np.ceil(least):.0f} mm."
            )
        return ""

    @property
    def invitation(self) -> str:
        """Sentence about what may be dragged."""
        return "Drag an end." if self.ends_only else "Drag an end or the middle."

    @property
    def description(self) -> str:
        """Sentence about what counts."""
        if self.ends_only:
            return "Both ends count, the shape between them is free."
        if part := self.part:
            return f"{1e3 * part[0]:g} to {1e3 * part[1]:g} mm of the rope count, the rest is free."
        return "The rope will rest in this shape."
