"""Sections of a run: its end, its files and what changes during it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from lariat.configuration import Bounds
from lariat.scenario.sections.goal import Shape
from lariat.scenario.sections.quantities import Position
from lariat.scenario.sections.scene import Obstacle


@dataclass(frozen=True)
class Run:
    """End of a run."""

    time_limit: Annotated[float, Bounds(0.1, 3600.0, "s")] = 10.0
    """Duration after which a run ends."""
    tolerance: Annotated[float, Bounds(1e-6, 0.5, "m")] = 0.003
    """Mean distance of the nodes that count from the goal below which it counts as reached."""
    angle_tolerance: Annotated[float, Bounds(1e-3, 3.2, "rad")] = 0.05
    """Angle of rotating ends from a goal of the ends alone below which it counts as reached."""


@dataclass(frozen=True)
class Recording:
    """Files of the recorder: one for each run, and thin ones of the idle cell between runs."""

    pre_roll: Annotated[float, Bounds(0.0, 30.0, "s")] = 3.0
    """Time before a run that its file holds."""
    start_up: Annotated[float, Bounds(0.0, 3600.0, "s")] = 0.0
    """Time after the recorder's start that is recorded whole; a run that begins within it is
    replayed exactly."""
    longest_file: Annotated[float, Bounds(1.0, 86400.0, "s")] = 3600.0
    """Time after which the next file begins."""
    largest_file: Annotated[float, Bounds(0.001, 1000.0, "GB")] = 1.0
    """Size after which the next file begins."""


@dataclass(frozen=True)
class Event:
    """Change of the scene or the goal at a given time of a run."""

    time: Annotated[float, Bounds(0.0, 3600.0, "s")]
    """Time since the start of the run."""
    add_obstacle: Obstacle | None = None
    """Obstacle that appears."""
    move_obstacle: str = ""
    """Name of the obstacle that moves to `position`."""
    remove_obstacle: str = ""
    """Name of the obstacle that disappears."""
    position: Position | None = None
    """New position of `move_obstacle`."""
    goal: Shape | None = None
    """New goal."""

    def __post_init__(self) -> None:
        actions = [self.add_obstacle, self.move_obstacle, self.remove_obstacle, self.goal]
        if sum(bool(a) for a in actions) != 1:
            raise ValueError(
                "give exactly one of add_obstacle, move_obstacle, remove_obstacle and goal"
            )
        if bool(self.move_obstacle) != (self.position is not None):
            raise ValueError("give move_obstacle and position together")
