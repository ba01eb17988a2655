"""Input and output of the planner."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import Bool, Float64

from lariat.geometry import polylines, poses
from lariat.geometry.grippers import gripper_axis_distance, swept_gripper_points
from lariat.geometry.grips import Grips
from lariat.geometry.obstacles import Obstacle, pack
from lariat.geometry.poses import Pose
from lariat.rod import Rod, RodState, add_turns, state_along
from lariat.safety.motion_contract import (
    PATH_STRETCH_SHARE,
    SETPOINT_PERIOD,
    longest_grip_distance,
)
from lariat.scenario.sections import Goal, Limits
from lariat.trajectory import NANOSECONDS

if TYPE_CHECKING:
    # Only a cell with arms needs Pinocchio.
    from lariat.planning.arms.cell_arms import CellArms


PATH_PERIOD = SETPOINT_PERIOD * NANOSECONDS
"""Time between points of a path [s]."""
UNMOVED = Pose(np.zeros(3), poses.IDENTITY)
"""Pose of an end that its grip holds where it seems to."""


@dataclass(frozen=True)
class DrawnRope:
    """Rope and grips, drawn from what is known of them."""

    rod: Rod
    """Rod with drawn properties."""
    held: tuple[Pose, Pose]
    """Poses of its ends in the frames of the grippers: left, right."""


@dataclass(frozen=True)
class Problem:
    """Planning problem: from a rope at rest to a goal shape, without collisions.

    Its grips are the rope's ends; a gripper may hold them a little beside its own frame.
    """

    rod: Rod
    """Model of the rope."""
    state: RodState
    """State of the rope at rest between the grips."""
    grips: tuple[Pose, Pose]
    """Current poses of the grips: left, right."""
    goal: Goal
    """Goal shape, of which all nodes count, or the ends alone, with the turns free. Its grips are
    an initial guess where only nodes were given."""
    moves: Bool[np.ndarray, "2 6"]
    """Mask of the free components of each grip's velocity: translation, then rotation."""
    obstacles: tuple[Obstacle, ...]
    """Obstacles that the rope must not touch, and regions that it must not leave."""
    supports: tuple[Obstacle, ...]
    """Obstacles that the rope may lean on."""
    limits: Limits
    """Limits of the grippers' motion."""
    clearance: float
    """Clearance to keep between all surfaces [m]."""
    tolerance: float
    """Mean node distance to the goal at which it is reached [m]."""
    spare_clearance: float = 0.0
    """Part of the clearance without which a path is not blocked [m]."""
    angle_tolerance: float = 0.05
    """Angle of the ends from such a goal at which it is reached [rad]."""
    variants: tuple[Rod, ...] = ()
    """Rods with one identified property off by its standard deviation each."""
    drawn: tuple[DrawnRope, ...] = ()
    """Ropes drawn from what is known of the present one; none where all is known."""
    held: tuple[Pose, Pose] = (UNMOVED, UNMOVED)
    """Poses of the rope's ends in the frames of the grippers: left, right."""
    pace: float = 1.0
    """Share of the usual limits on motion that the path uses [-]."""
    seed: int = 0
    """Seed of the random number generator for random paths."""
    planning_time: float = np.inf
    """Processor time after which no further search is begun [s]."""
    arms: CellArms | None = None
    """Arms that hold the grips, as they stand at the start; None where their geometry is unknown or
    they have none."""

    @property
    def solid(self) -> tuple[Obstacle, ...]:
        """Bodies that the grippers must not touch: obstacles of the rope and its supports."""
        return tuple(o for o in self.obstacles if not o.keep_in) + self.supports

    @property
    def regions(self) -> tuple[Obstacle, ...]:
        """Regions that the rope, and so both grips, must not leave."""
        return tuple(o for o in self.obstacles if o.keep_in)

    @property
    def packed_supports(self) -> Float64[np.ndarray, "m 13"] | None:
        """Supports as rows of `lariat.geometry.obstacles.pack`; None when there are none."""
        return pack(self.supports) if self.supports else None

    def goal_error(self, nodes: Float64[np.ndarray, "n 3"]) -> float:
        """Return the mean distance of the nodes that count from the goal [m].

        Where the ends alone count, an angle of theirs that is as large as its tolerance is worth
        the tolerance of the distance.

        Args:
            nodes: Nodes of the rope [m].
        """
        goal = self.goal
        error = polylines.mean_node_distance(nodes[goal.counted], goal.nodes[goal.counted])
        return max(error, self.tolerance * goal.angle(nodes) / self.angle_tolerance)

    def with_goal(self, **changes: Any) -> Problem:
        """Return the problem with other fields of the goal."""
        return replace(self, goal=replace(self.goal, **changes))

    @property
    def feasible_goal_grips(self) -> tuple[Pose, Pose]:
        """Grips of the goal, as far as the ends can move and rotate."""
        left, right = (
            Pose(
                goal.position if moves[:3].any() else now.position,
                goal.orientation if moves[3:].any() else now.orientation,
            )
            for now, goal, moves in zip(self.grips, self.goal.grips, self.moves, strict=True)
        )
        return left, right

    def grippers(self, ends: Grips) -> Grips:
        """Return the poses of the grippers that hold the rope's ends at poses."""
        return _beside(ends, [end.inverse() for end in self.held])

    def ends(self, grippers: Grips) -> Grips:
        """Return the poses of the rope's ends that grippers at poses hold."""
        return _beside(grippers, self.held)

    def gripper_points(self, ends: Grips) -> Float64[np.ndarray, "k 6 3"]:
        """Return points on the axes of the grippers that hold the ends (`gripper_points`) [m]."""
        held, reach = self.grippers(ends), self.limits.gripper_reach
        points = swept_gripper_points(held.positions, held.orientations, reach)
        return points.reshape(-1, 6, 3)

    def gripper_distances(
        self, ends: Grips
    ) -> tuple[Float64[np.ndarray, "k"], Float64[np.ndarray, "k 3"]]:
        """Return the distances between the grippers' axes [m], and their directions."""
        held = self.grippers(ends)
        return gripper_axis_distance(held.positions, held.orientations, self.limits.gripper_reach)

    def rest(
        self, ends: tuple[Pose, Pose], nodes: Float64[np.ndarray, "n 3"], turns: int = 0
    ) -> RodState:
        """Return the rope at rest on or above its supports, in the shape nearest to given nodes.

        Args:
            ends: Poses of the rope's ends.
            nodes: Nodes of the shape [m].
            turns: Whole turns of twist of that shape.

        Raises:
            ValueError: The rope does not reach from end to end.
        """
        guess = add_turns(state_along(nodes, *(end.orientation for end in ends)), turns)
        return self.rod.rest(*ends, guess=guess, obstacles=self.packed_supports).state

    @property
    def longest_grip_distance(self) -> float:
        """Distance of the grips that a path does not exceed [m]."""
        return longest_grip_distance(
            PATH_STRETCH_SHARE,
            self.limits.overstretch * self.rod.properties.length,
            max(grip_distance(self.grips), grip_distance(self.goal.grips)),
        )

    @property
    def radius(self) -> float:
        """Radius of the rope [m]."""
        return self.rod.properties.diameter / 2.0


def grip_distance(grips: tuple[Pose, Pose]) -> float:
    """Return the distance between two grips [m]."""
    return float(np.linalg.norm(grips[1].position - grips[0].position))


def _beside(grips: Grips, frames: Sequence[Pose]) -> Grips:
    """Poses that are given in the frames of both grips."""
    arms = poses.rotate(grips.orientations, np.array([pose.position for pose in frames]))
    turns = np.array([pose.orientation for pose in frames])
    return Grips(grips.positions + arms, poses.multiply(grips.orientations, turns))


@dataclass(frozen=True)
class WholePath(Grips):
    """Timed path of both grips, with the shape of the rope along it."""

    nodes: Float64[np.ndarray, "k n 3"]
    """Nodes of the rope [m]."""
    reached: bool
    """Whether the path reaches the goal without collision."""
    reason: str
    """Reason why the path does not reach the goal; empty when it does."""
    final_error: float
    """Mean node distance to the goal at the end of the path, at rest [m]."""
    clearance: float
    """Least clearance of rope and grippers along the path [m]."""
    blocked: bool = False
    """Whether obstacles prevent it from reaching the goal, so that it ends at the nearest reachable
    shape."""
    arm_fault: str = ""
    """What an arm would break along the path, in words; empty where the arms can go it."""
    dt: float = PATH_PERIOD
    """Time between points [s]."""

    @property
    def duration(self) -> float:
        """Time from the first point to the last one [s]."""
        return self.dt * (len(self) - 1)

    def after(self, first: WholePath) -> WholePath:
        """Return the path that goes another one first, which ends where this one begins."""
        return replace(
            self,
            positions=np.concatenate([first.positions, self.positions[1:]]),
            orientations=np.concatenate([first.orientations, self.orientations[1:]]),
            nodes=np.concatenate([first.nodes, self.nodes[1:]]),
            clearance=min(first.clearance, self.clearance),
        )

    def of_grippers(self, problem: Problem) -> WholePath:
        """Return the path of the grippers that lead the rope's ends along this one."""
        held = problem.grippers(self)
        return replace(self, positions=held.positions, orientations=held.orientations)
