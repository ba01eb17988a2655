"""Planner from outside: its waypoints are timed, simulated and checked as Lariat's own are."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from lariat.geometry import poses
from lariat.planning.collision_check import gripper_overlap, path_clearance
from lariat.planning.dynamic_check import simulate_path
from lariat.planning.problem import Problem, WholePath
from lariat.planning.retiming import PATH_PERIOD, RETIMING_SETTINGS
from lariat.planning.shorter_path import stay
from lariat.planning.time_parameterization import Pace, time_parameterize
from lariat.protocols import GripPath, PathPlanner, PlannerSetup, PlanningProblem
from lariat.rod import state_along
from lariat.scenario import Scenario
from lariat.scenario.extensions import Extension, ExtensionFault

PACE = Pace(1.3, (0.4, 0.4))
"""Pace at which waypoints are passed; its running means hardly excite a hanging rope."""
MAX_START_ERROR = 1e-3
"""Distance of the first waypoints from the grips above which a path is refused [m]."""


class ExtensionPlanner:
    """Planner of whole paths by a `lariat.protocols.PathPlanner`."""

    def __init__(self, extension: Extension, scenario: Scenario, moves: np.ndarray) -> None:
        """Create the planner of a cell.

        Args:
            extension: Its name.
            scenario: The cell.
            moves: Free components of each grip's velocity.

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
        """Return the path of a problem; one that stays where the planner finds none or fails.

        Args:
            problem: Planning problem.
        """
        try:
            path = self._path(problem)
        except ExtensionFault as fault:
            return stay(problem, str(fault))
        if path is None:
            return stay(problem, f"{self._extension} finds no path")
        return self._checked(problem, path)

    def _path(self, problem: Problem) -> GripPath | None:
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
        return GripPath(positions, poses.normalized(orientations))

    def _checked(self, problem: Problem, path: GripPath) -> WholePath:
        """Timed path with the rope along it, and whether it is clear and reaches the goal."""
        limits = problem.limits.scaled(problem.pace)
        positions, orientations = time_parameterize(
            path.positions, path.orientations, limits, PATH_PERIOD, PACE
        )
        nodes, _ = simulate_path(problem, positions, orientations, PATH_PERIOD)
        grips = [poses.Pose(p, q) for p, q in zip(positions[-1], orientations[-1], strict=True)]
        guess = state_along(nodes[-1], *orientations[-1])
        end = problem.rod.rest(*grips, guess=guess, obstacles=problem.packed_supports)
        error = problem.goal_error(end.state.positions)
        clearance = path_clearance(problem, positions, orientations, nodes)
        overlap = gripper_overlap(problem, positions, orientations)
        least = min(RETIMING_SETTINGS.min_clearance, problem.clearance)
        reason = ""
        if overlap > 0.0:
            reason = f"the grippers come {1e3 * overlap:.1f} mm too close to each other"
        elif clearance < least - RETIMING_SETTINGS.clearance_tolerance:
            reason = (
                f"it comes within {1e3 * clearance:.1f} mm of an obstacle "
                f"({1e3 * least:.1f} mm needed)"
            )
        if reason:
            return stay(problem, f"blocked: the path of {self._extension} is refused: {reason}")
        timed = WholePath(PATH_PERIOD, positions, orientations, nodes, True, "", error, clearance)
        if error <= problem.tolerance:
            return timed
        return replace(
            timed,
            reached=False,
            reason=f"the path of {self._extension} ends {1e3 * error:.1f} mm from the goal",
        )
