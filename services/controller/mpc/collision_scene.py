"""What lies around the rope, and how near the rope may come to it now."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float64

from lariat.geometry import obstacles as geometry
from lariat.geometry.grippers import axis_clearance
from lariat.geometry.obstacles import Obstacle, signed_distance
from services.controller.mpc.collision_avoidance import AvoidanceSpecification, gripper_axis_points
from services.controller.run.task import Task
from shared.motion_contract import CONTROL_STRETCH_SHARE
from shared.scenario import Scenario

NEAR_GOAL = 0.03
"""Mean node distance to the goal from which its own clearance is enough [m]."""
STRETCH = 0.002
"""By which the rope may be pulled longer, as a share of its length [-]."""
LENIENCE = 5e-4
"""By which a goal's own clearance may be missed [m]."""


class CollisionScene:
    """The obstacles of the present scene."""

    def __init__(self, scenario: Scenario) -> None:
        self._scenario = scenario
        self._goal_clearances: tuple[tuple[int, int], float, float] = (-1, -1), np.inf, np.inf
        self.update(scenario.bodies, 0)

    def update(self, obstacles: tuple[Obstacle, ...], revision: int) -> None:
        """Takes another scene."""
        self.obstacles, self.revision = obstacles, revision
        self.avoided = tuple(o for o in obstacles if not o.support)
        """All that must not be touched."""

    @property
    def supports(self) -> Float64[np.ndarray, "m 12"] | None:
        """What the rope may lean on, packed for the rod."""
        supports = [o for o in self.obstacles if o.support]
        return geometry.pack(supports) if supports else None

    def avoidance(self, task: Task, error: float) -> AvoidanceSpecification:
        """For the objective.

        Args:
            error: Mean node distance to the goal now [m].
        """
        rope, limits = self._scenario.rope, self._scenario.limits
        own, grippers_own = self._own(task)
        wanted = self._scenario.control.clearance
        body = axis_clearance(limits.gripper_radius, limits.keep_out)
        return AvoidanceSpecification(
            self.avoided,
            # All that is wanted on the way, no more than the goal has at its end.
            min(wanted, own - LENIENCE) if error < NEAR_GOAL else wanted,
            rope.diameter / 2.0,
            CONTROL_STRETCH_SHARE * limits.overstretch * rope.length,
            (1.0 + STRETCH) * rope.length,
            self.obstacles,
            limits.gripper_reach,
            min(body, grippers_own - LENIENCE),
        )

    def _own(self, task: Task) -> tuple[float, float]:
        """Clearances that the goal has itself: of the rope, and of the grippers' axes [m]."""
        key = (task.goal_revision, self.revision)
        if self._goal_clearances[0] != key:
            scenario, nodes = self._scenario, task.goal.nodes
            own = geometry.chain_clearance(nodes, scenario.rope.diameter / 2.0, self.avoided)
            bodies = gripper_axis_points(nodes, scenario.limits.gripper_reach)
            distances = [float(np.min(signed_distance(bodies, o))) for o in self.obstacles]
            self._goal_clearances = key, own, min(distances, default=np.inf)
        return self._goal_clearances[1:]
