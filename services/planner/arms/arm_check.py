"""Check of the arms along a path, by the constraints that the gateway evaluates too."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float64

from lariat.geometry.poses import Pose, interpolate
from services.planner.problem import Problem
from shared.constraints.collision import CollisionConstraint
from shared.constraints.joints import JointConstraints
from shared.constraints.obstacle_scene import ObstacleScene
from shared.constraints.rule import Rule
from shared.constraints.singularity import singularity_slack
from shared.constraints.slacks import Slacks, first_broken
from shared.constraints.spacing import body_spacing_slack
from shared.constraints.sphere_distance import Spheres
from shared.motion_contract import CHUNK_BOUNDARY_MARGIN
from shared.scenario import SIDES

if TYPE_CHECKING:
    # Only a cell with arms needs Pinocchio.
    from services.planner.arms.cell_arms import CellArms

SOLVED_STRIDE = 2
"""Points of a timed path from one whose joints are solved to the next."""
LINK_MARGIN = CHUNK_BOUNDARY_MARGIN + 0.004
"""Distance that links keep beyond their limit [m]: more than the gateway demands, because the
controller corrects the path while it follows it."""
LEAST_LINK_MARGIN = CHUNK_BOUNDARY_MARGIN + 0.0005
"""The same along a path that was optimised for its links, and at the goal [m]."""
JOINT_SPEED_SHARE = 0.75
"""Share of the limit on the speed of a joint that a path uses [-]; the controller adds to it."""
STEPS_TO_GOAL = 25
"""Steps in which the joints are followed to the goal."""

WORDS: dict[Rule, str] = {
    "keep_out": "a link of the {side} arm comes {mm:.1f} mm too close to an obstacle",
    "table": "a link of the {side} arm goes {mm:.1f} mm below the table's limit",
    "joint_limits": "a joint of the {side} arm turns {rad:.2f} rad beyond its limit",
    "joint_speed": "a joint of the {side} arm turns {rad:.2f} rad/s too fast",
    "singularity": "the {side} arm is stretched out or singular",
    "spacing": "the two arms come {mm:.1f} mm too close to each other",
}
"""Words for each rule that an arm can break."""


@dataclass(frozen=True)
class ArmFault:
    """First rule that an arm breaks along a path."""

    rule: Rule
    """The rule."""
    side: str
    """End of the arm."""
    amount: float
    """By how much it is broken [m, rad or rad/s]."""

    def __str__(self) -> str:
        return WORDS[self.rule].format(side=self.side, mm=1e3 * self.amount, rad=self.amount)


def arm_fault(
    problem: Problem,
    positions: Float64[np.ndarray, "t 2 3"],
    orientations: Float64[np.ndarray, "t 2 4"],
    dt: float,
    margin: float = LINK_MARGIN,
) -> ArmFault | None:
    """Return the first rule that an arm breaks along a timed path; None where all are kept.

    Args:
        problem: Arms and obstacles.
        positions: Positions of the rope's ends [m].
        orientations: Their orientations, wxyz.
        dt: Time between two points [s].
        margin: Distance that links and bodies keep beyond their limit [m].
    """
    cell = problem.arms
    if cell is None:
        return None
    positions, orientations = problem.grippers(positions, orientations)
    collision = CollisionConstraint(problem.limits.keep_out)
    collision.scene = ObstacleScene(problem.solid)
    last = len(positions) - 1
    solved = sorted({*range(0, last, SOLVED_STRIDE), last})
    bodies: dict[int, Spheres] = {}
    for end, arm in cell.arms.items():
        joints = JointConstraints(arm.kinematics, JOINT_SPEED_SHARE * arm.joint_speed)
        joints.set_joints(tuple(cell.joints[end]))
        found = joints.broken(
            positions[:, end], orientations[:, end], solved, collision, margin, dt
        )
        if found is not None:
            return ArmFault(found[0], SIDES[end], found[1])
        bodies[end] = joints.spheres()
    rows = [0, *solved]
    both = [_with_gripper(cell, end, bodies, positions[rows], orientations[rows]) for end in (0, 1)]
    slack = body_spacing_slack(both[0], both[1], problem.limits.keep_out)
    broken = first_broken({"spacing": slack}, margin)
    return None if broken is None else ArmFault("spacing", "", broken[1])


def start_fault(problem: Problem) -> ArmFault | None:
    """Return the rule that an arm breaks at the start; None where all are kept there.

    The gateway lets arms leave what they break already, but never makes it worse.

    Args:
        problem: Arms, obstacles and start.
    """
    return goal_fault(replace(problem, goal_grips=problem.grips, oriented=(True, True)))


def goal_fault(problem: Problem) -> ArmFault | None:
    """Return the rule that an arm breaks at the goal itself; None where all are kept there.

    The arm's branch of the inverse kinematics is followed on the straight way to the goal. None is
    returned too where this cannot be told: a grip may turn at will, or an arm cannot go straight.

    Args:
        problem: Arms, obstacles and goal.
    """
    cell = problem.arms
    turns = problem.moves[:, 3:].any(axis=1)
    if cell is None or np.any(turns & ~np.array(problem.oriented)):
        return None
    ends = [problem.grips, problem.feasible_goal_grips]
    positions, orientations = problem.grippers(
        np.array([[grip.position for grip in grips] for grips in ends]),
        np.array([[grip.orientation for grip in grips] for grips in ends]),
    )
    collision = CollisionConstraint(problem.limits.keep_out)
    collision.scene = ObstacleScene(problem.solid)
    bodies: dict[int, Spheres] = {}
    for end, arm in cell.arms.items():
        start, goal = (
            Pose(p, q) for p, q in zip(positions[:, end], orientations[:, end], strict=True)
        )
        joints = cell.joints[end]
        for share in np.linspace(0.0, 1.0, STEPS_TO_GOAL + 1)[1:]:
            found = arm.kinematics.solve(interpolate(start, goal, float(share)), joints)
            if found is None:
                return None
            joints = found
        low, high = arm.kinematics.joint_range
        links = Spheres(*arm.kinematics.link_spheres(joints[None]))
        slacks: Slacks = {
            "joint_limits": np.array([np.min(np.minimum(joints - low, high - joints))]),
            "singularity": singularity_slack(arm.kinematics, joints[None]),
        }
        for rule, slack in collision.slacks(links.centres, links.radii).items():
            slacks[rule] = slack - LEAST_LINK_MARGIN
        for rule, slack in slacks.items():
            if not slack[0] >= 0.0:
                return ArmFault(rule, SIDES[end], -float(slack[0]))
        centres, radii = arm.kinematics.base_spheres
        bodies[end] = Spheres.joined([links, Spheres(centres[None], radii)])
    both = [_with_gripper(cell, end, bodies, positions[1:], orientations[1:]) for end in (0, 1)]
    wanted = problem.limits.keep_out + LEAST_LINK_MARGIN
    slack = float(body_spacing_slack(both[0], both[1], wanted)[0])
    return None if slack >= 0.0 else ArmFault("spacing", "", -slack)


def _with_gripper(
    cell: CellArms,
    end: int,
    bodies: dict[int, Spheres],
    positions: Float64[np.ndarray, "m 2 3"],
    orientations: Float64[np.ndarray, "m 2 4"],
) -> Spheres:
    """Spheres of an end: its gripper, and its arm where there is one."""
    gripper = cell.gripper_spheres(end, positions[:, end], orientations[:, end])
    return Spheres.joined([gripper, *([bodies[end]] if end in bodies else [])])
