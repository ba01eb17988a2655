"""Planner from outside: its waypoints are timed, simulated and checked as Lariat's own are."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from lariat.geometry import poses
from lariat.geometry.grips import Grips
from lariat.planning.problem import Problem, WholePath
from lariat.planning.retiming import path_through
from lariat.planning.shorter_path import stay
from lariat.protocols import PathPlanner, PlannerSetup, PlanningProblem
from lariat.scenario import Scenario
from lariat.scenario.extensions import Extension, ExtensionFault

MAX_START_ERROR = 1e-3
"""Distance of the first waypoints from the grips above which a path is refused [m]."""


class ExtensionPlanner:
    """Planner of whole paths by a `lariat.protocols.PathPlanner`."""

    def __init__(self, extension: Extension, scenario: Scenario, moves: np.ndarray) -> None:
        """Create the planner of a cell.

        Raises:
            ConfigurationError: The class cannot be imported or is no planner.
        """
        self._extension = extension
        limits = scenario.limits
        setup = PlannerSetup(
            moves.copy(),
            limits,
            np.array(limits.workspace),
            limits.overstretch * scenario.rope.length,
            scenario.seed,
        )
        self._planner: PathPlanner = extension.create(("plan",), setup)

    def plan(self, problem: Problem) -> WholePath:
        """Return the path of a problem; one that stays where the planner finds none or fails."""
        try:
            path = self._path(problem)
        except ExtensionFault as fault:
            return stay(problem, str(fault))
        if path is None:
            return stay(problem, f"{self._extension} finds no path")
        return self._checked(problem, path)

    def _path(self, problem: Problem) -> Grips | None:
        """Waypoints of the planner, with numbers and shapes checked."""
        task = PlanningProblem(
            problem.rod,
            problem.state,
            problem.grips,
            problem.goal.nodes.copy(),
            problem.goal.grips,
            problem.obstacles,
            problem.supports,
            problem.clearance,
            problem.tolerance,
        )
        with self._extension.guarded("plan"):
            waypoints = self._planner.plan(task)
            if waypoints is None:
                return None
            positions, orientations = waypoints.positions, waypoints.orientations
        positions = self._extension.checked("plan", positions, (-1, 2, 3))
        orientations = self._extension.checked("plan", orientations, (len(positions), 2, 4))
        if len(positions) < 2 or np.any(np.linalg.norm(orientations, axis=2) < 0.5):
            raise ExtensionFault(
                f"{self._extension}: plan() answered fewer than two waypoints, or orientations "
                "that are no unit quaternions"
            )
        start = np.array([grip.position for grip in problem.grips])
        error = float(np.max(np.linalg.norm(positions[0] - start, axis=1)))
        if error > MAX_START_ERROR:
            raise ExtensionFault(
                f"{self._extension}: plan() answered a path that begins {1e3 * error:.1f} mm from "
                "the grips"
            )
        return Grips(positions, poses.normalized(orientations))

    def _checked(self, problem: Problem, path: Grips) -> WholePath:
        """Timed path with the rope along it, and whether it is clear and reaches the goal."""
        timed = path_through(problem, path)
        if timed.blocked:
            reason = f"the path of {self._extension} is refused: {timed.reason}"
            return stay(problem, f"blocked: {reason}")
        if timed.reached:
            return timed
        return replace(timed, reason=f"the path of {self._extension} {timed.reason}")
