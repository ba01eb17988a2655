"""What lies around the rope, and how near the rope may come to it now."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float64

from services.controller.objective import Surroundings
from services.controller.task import Task
from shared.geometry import obstacles as geometry
from shared.geometry.obstacles import Obstacle
from shared.scenario import Scenario

NEAR_GOAL = 0.03
"""Mean node distance to the goal from which its own clearance is enough [m]."""
STRETCH = 0.002
"""By which the rope may be pulled longer, as a share of its length [-]."""
LENIENCE = 5e-4
"""By which a goal's own clearance may be missed [m]."""


class Vicinity:
    """The obstacles of the present scene."""

    def __init__(self, scenario: Scenario) -> None:
        self._scenario = scenario
        self._goal_clearance: tuple[tuple[int, int], float] = (-1, -1), np.inf
        self.lay(scenario.bodies, 0)

    def lay(self, obstacles: tuple[Obstacle, ...], revision: int) -> None:
        """Takes another scene."""
        self.obstacles, self.revision = obstacles, revision
        self.avoided = tuple(o for o in obstacles if not o.support)
        """All that must not be touched."""

    @property
    def supports(self) -> Float64[np.ndarray, "m 12"] | None:
        """What the rope may lean on, packed for the rod."""
        supports = [o for o in self.obstacles if o.support]
        return geometry.pack(supports) if supports else None

    def surroundings(self, task: Task, error: float) -> Surroundings:
        """For the objective.

        Args:
            error: Mean node distance to the goal now [m].
        """
        rope, limits = self._scenario.rope, self._scenario.limits
        return Surroundings(
            self.avoided,
            self._clearance(task, error),
            rope.diameter / 2.0,
            0.99 * limits.overstretch * rope.length,
            (1.0 + STRETCH) * rope.length,
        )

    def _clearance(self, task: Task, error: float) -> float:
        """What to keep: all that is wanted on the way, no more than the goal has at its end [m]."""
        wanted = self._scenario.control.clearance
        key = (task.goal_revision, self.revision)
        if self._goal_clearance[0] != key:
            radius = self._scenario.rope.diameter / 2.0
            own = geometry.chain_clearance(task.goal.nodes, radius, self.avoided)
            self._goal_clearance = key, own
        return min(wanted, self._goal_clearance[1] - LENIENCE) if error < NEAR_GOAL else wanted
