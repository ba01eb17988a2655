"""Collision scene: the obstacles around the rope, and the clearances to keep from them.

The regions that the rope is kept in are obstacles for the rope alone."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float64

from lariat.control.mpc.collision_avoidance import AvoidanceSpecification
from lariat.control.run.task import Task
from lariat.geometry import obstacles as geometry
from lariat.geometry.grippers import axis_clearance, gripper_points
from lariat.geometry.obstacle_motion import ObstacleMotion, obstacles_at, obstacles_during
from lariat.geometry.obstacles import Obstacle, signed_distance
from lariat.safety.motion_contract import CONTROL_STRETCH_SHARE, longest_grip_distance
from lariat.scenario import Scenario
from lariat.trajectory import NANOSECONDS

GOAL_CLEARANCE_RADIUS = 0.03
"""Mean node distance to the goal below which the goal's own clearance is enough [m]."""
MAX_STRETCH = 0.002
"""Stretch of the rope that is allowed, as a share of its length [-]."""
MOTION_FORESIGHT = 0.25
"""Time by which moving obstacles are avoided in advance: the duration of a horizon [s]."""
GOAL_CLEARANCE_TOLERANCE = 5e-4
"""Amount by which a goal's own clearance may be missed [m]."""


class CollisionScene:
    """Obstacles of the present scene."""

    def __init__(self, scenario: Scenario) -> None:
        """Create the scene of a scenario.

        Args:
            scenario: Rope, limits and obstacles.
        """
        self._scenario = scenario
        self.clearance = scenario.control.clearance
        """Desired distance of the rope's surface from obstacles [m]."""
        self._goal_clearances: tuple[tuple[int, int, int], float, float]
        self._goal_clearances = (-1, -1, -1), np.inf, np.inf
        self._regions = scenario.regions
        self._others: tuple[Obstacle, ...] = ()
        self.others_revision = 0
        """Revision of the other ropes."""
        self._motions: tuple[ObstacleMotion, ...] = ()
        self._time = 0.0
        self.run_started = 0
        """Start of the run that the motions of obstacles belong to [ns]; 0 where there are none."""
        self.update(scenario.bodies, 0)

    def update(self, obstacles: tuple[Obstacle, ...], revision: int) -> None:
        """Replace the obstacles.

        Args:
            obstacles: All obstacles.
            revision: Revision of the scene.
        """
        self._scene, self.revision = obstacles, revision
        self._join()

    def update_others(self, others: tuple[Obstacle, ...], revision: int) -> None:
        """Replace the other ropes.

        They are avoided as obstacles are; a goal beside one does not lower the clearance from it.

        Args:
            others: Capsules around the ropes beside the held one.
            revision: Revision of those ropes.
        """
        self._others, self.others_revision = others, revision
        self._join()

    def update_motions(self, motions: tuple[ObstacleMotion, ...], run_started: int) -> None:
        """Replace the known motions of obstacles.

        Args:
            motions: Motions, in the clock of the stamps.
            run_started: Start of the run that they belong to [ns].
        """
        self._motions, self.run_started = motions, run_started
        self._join()

    def advance(self, now: int) -> None:
        """Move the obstacles whose motion is known.

        Args:
            now: Present time [ns].
        """
        self._time = now * NANOSECONDS
        if self._motions:
            self._join()

    def _join(self) -> None:
        now, later = self._time, self._time + MOTION_FORESIGHT
        present = obstacles_at(self._scene, self._motions, now)
        self.obstacles = (*present, *self._others, *self._regions)
        """All obstacles: those of the scene, where they are, other ropes, and the regions."""
        self.foreseen = (*obstacles_during(self._scene, self._motions, now, later), *self._others)
        """Bodies among them, moving ones also where they will be until the end of a horizon."""
        self.avoided = (*(o for o in self.foreseen if not o.support), *self._regions)
        """Foreseen obstacles that the rope must not touch, and regions that it must not leave."""
        moving = {motion.name for motion in self._motions}
        self.still = tuple(o for o in self.avoided if o.name not in moving)
        """Those whose motion the planner does not know: they stand still."""

    @property
    def supports(self) -> Float64[np.ndarray, "m 13"] | None:
        """Obstacles that the rope may lean on, packed for the rod."""
        return geometry.pack_supports(self.obstacles)

    def avoidance(self, task: Task, error: float) -> AvoidanceSpecification:
        """Obstacles and clearances for the horizon.

        Args:
            task: Task whose goal is approached.
            error: Present mean node distance to the goal [m].
        """
        rope, limits = self._scenario.rope, self._scenario.limits
        _, grippers_own = self._clearances_of_goal(task)
        whole = self.clearance
        body = axis_clearance(limits.gripper_radius, limits.keep_out)
        return AvoidanceSpecification(
            self.avoided,
            # The whole clearance on the way, at the end no more than the goal itself has.
            min(whole, self.goal_clearance(task)) if error < GOAL_CLEARANCE_RADIUS else whole,
            rope.diameter / 2.0,
            longest_grip_distance(
                CONTROL_STRETCH_SHARE,
                limits.overstretch * rope.length,
                float(np.linalg.norm(task.goal.right.position - task.goal.left.position)),
            ),
            MAX_STRETCH,
            self.foreseen,
            limits.gripper_reach,
            min(body, grippers_own - GOAL_CLEARANCE_TOLERANCE),
        )

    def goal_clearance(self, task: Task) -> float:
        """Clearance of the goal itself, less what may be missed [m].

        Args:
            task: Task whose goal is approached.
        """
        return self._clearances_of_goal(task)[0] - GOAL_CLEARANCE_TOLERANCE

    def _clearances_of_goal(self, task: Task) -> tuple[float, float]:
        """Clearances of the goal itself: of the rope, and of the grippers' axes [m]."""
        key = (task.goal_revision, self.revision, self.run_started)
        if self._goal_clearances[0] != key:
            scenario, nodes = self._scenario, task.goal.nodes
            finally_there = obstacles_at(self._scene, self._motions, np.inf)
            avoided = [*(o for o in finally_there if not o.support), *self._regions]
            own = geometry.chain_clearance(nodes, scenario.rope.diameter / 2.0, avoided)
            bodies = gripper_points(task.goal.left, task.goal.right, scenario.limits.gripper_reach)
            distances = [float(np.min(signed_distance(bodies, o))) for o in finally_there]
            self._goal_clearances = key, own, min(distances, default=np.inf)
        return self._goal_clearances[1:]
