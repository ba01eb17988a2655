"""Path planner of one's own: lift, carry, lower."""

from __future__ import annotations

import numpy as np

from lariat.protocols import GripPath, PlannerSetup, PlanningProblem


class Lift:
    """Path that lifts the rope, carries it over the goal and lowers it."""

    def __init__(self, setup: PlannerSetup) -> None:
        self.top = setup.workspace[1, 2]

    def plan(self, problem: PlanningProblem) -> GripPath | None:
        start = np.array([grip.position for grip in problem.grips])
        end = np.array([grip.position for grip in problem.goal_grips])
        height = 0.45 - min(start[:, 2].min(), end[:, 2].min())
        if max(start[:, 2].max(), end[:, 2].max()) + height > self.top:
            return None
        up = np.array([0.0, 0.0, height])
        pick = np.array([grip.orientation for grip in problem.grips])
        put = np.array([grip.orientation for grip in problem.goal_grips])
        return GripPath(
            np.stack([start, start + up, end + up, end]), np.stack([pick, pick, put, put])
        )
