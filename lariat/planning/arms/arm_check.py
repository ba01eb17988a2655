"""Check of the arms along a path, by the constraints that the gateway evaluates too."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float64

from lariat.geometry.grips import Grips
from lariat.geometry.poses import Pose, interpolate
from lariat.planning.problem import Problem, WholePath
from lariat.safety.constraints.collision import CollisionConstraint
from lariat.safety.constraints.joints import JointConstraints
from lariat.safety.constraints.obstacle_scene import ObstacleScene
from lariat.safety.constraints.rule import Rule
from lariat.safety.constraints.singularity import singularity_slack
from lariat.safety.constraints.slacks import Slacks, first_broken
from lariat.safety.constraints.spacing import body_spacing_slack
from lariat.safety.constraints.sphere_distance import Spheres
from lariat.safety.motion_contract import CHUNK_BOUNDARY_MARGIN
from lariat.scenario import SIDES

if TYPE_CHECKING:
    # Only a cell with arms needs Pinocchio.
    from lariat.planning.arms.cell_arms import CellArms

SOLVED_STRIDE = 2
"""Points of a timed path from one whose joints are solved to the next."""
LINK_MARGIN = CHUNK_BOUNDARY_MARGIN + 0.004
"""Distance that links keep beyond their limit [m]: more than the gateway demands, because the
controller corrects the path while it follows it."""
LEAST_LINK_MARGIN = CHUNK_BOUNDARY_MARGIN + 0.0005
"""The same along a path that was optimised for its links, and at the goal [m]."""
JOINT_SPEED_SHARE = 0.75
"""Share of the limit on the speed of a joint that a path uses [-]; the controller adds to it."""
JOINT_RULES: tuple[Rule, ...] = ("joint_limits", "singularity")
"""Rules without a margin."""
STEPS_TO_GOAL = 25
"""Steps in which the joints are followed to the goal."""

WORDS: dict[Rule, str] = {
    "keep_out": "a link of the {side} arm comes {mm:.1f} mm too close to an obstacle",
    "table": "a link of the {side} arm goes {mm:.1f} mm below the table's limit",
    "joint_limits": "a joint of the {side} arm turns {rad:.2f} rad beyond its limit",
    "joint_speed": "a joint of the {side} arm turns {rad:.2f} rad/s too fast",
    "joint_acceleration": "a joint of the {side} arm speeds up by {rad:.2f} rad/s² too much",
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
    """By how much it is broken [m, rad, rad/s or rad/s^2]."""

    def __str__(self) -> str:
        return WORDS[self.rule].format(side=self.side, mm=1e3 * self.amount, rad=self.amount)


def arm_fault(problem: Problem, path: WholePath, margin: float = LINK_MARGIN) -> ArmFault | None:
    """Return the first rule that an arm breaks along a timed path; None where all are kept.

    Args:
        margin: Distance that links and bodies keep beyond their limit [m].
    """
    cell = problem.arms
    if cell is None:
        return None
    grips = problem.grippers(path)
    collision = CollisionConstraint(problem.limits.keep_out)
    collision.scene = ObstacleScene(problem.solid)
    last = len(grips) - 1
    solved = sorted({*range(0, last, SOLVED_STRIDE), last})
    bodies: dict[int, Spheres] = {}
    for end, arm in cell.arms.items():
        joints = JointConstraints(arm, problem.limits, JOINT_SPEED_SHARE, 1.0)
        joints.set_joints(tuple(cell.joints[end]))
        poses_of_end = grips.positions[:, end], grips.orientations[:, end]
        fault = joints.broken(*poses_of_end, solved, collision, margin, path.dt)
        if fault is not None:
            return ArmFault(fault[0], SIDES[end], fault[1])
        bodies[end] = joints.spheres()
    broken = first_broken(
        {"spacing": _spacing_slack(problem, cell, grips[[0, *solved]], bodies)}, margin
    )
    return None if broken is None else ArmFault("spacing", "", broken[1])


def start_fault(problem: Problem) -> ArmFault | None:
    """Return the rule that an arm breaks at the start; None where all are kept there.

    The gateway lets arms leave what they break already, but never makes it worse. The table is left
    out: the base of an arm may stand in it.
    """
    if problem.arms is None:
        return None
    slacks = _standing_slacks(problem, problem.arms, [problem.grips])
    for side, rows in (slacks or {}).items():
        for rule, slack in rows.items():
            if rule != "table" and not slack[0] >= 0.0:
                return ArmFault(rule, side, -float(slack[0]))
    return None


def goal_fault(problem: Problem) -> ArmFault | None:
    """Return the rule that an arm breaks at the goal itself; None where all are kept there.

    The arm's branch of the inverse kinematics is followed on the straight way to the goal. None is
    returned too where this cannot be told: a grip may turn at will, or an arm cannot go straight.
    What is broken at the start already may stay so.
    """
    turns = problem.moves[:, 3:].any(axis=1)
    if problem.arms is None or np.any(turns & ~np.array(problem.goal.oriented)):
        return None
    ends = [problem.grips, problem.feasible_goal_grips]
    slacks = _standing_slacks(problem, problem.arms, ends)
    for side, rows in (slacks or {}).items():
        joints = {rule: slack for rule, slack in rows.items() if rule in JOINT_RULES}
        bodies = {rule: slack for rule, slack in rows.items() if rule not in JOINT_RULES}
        fault = first_broken(joints) or first_broken(bodies, LEAST_LINK_MARGIN)
        if fault is not None:
            return ArmFault(fault[0], side, fault[1])
    return None


def _standing_slacks(
    problem: Problem, cell: CellArms, ends: Sequence[tuple[Pose, Pose]]
) -> dict[str, Slacks] | None:
    """Slacks of all rules at poses of the rope's ends, by the arm's side; both arms' under "".

    Joints are followed on the straight way from pose to pose. None where an arm cannot go it.
    """
    grips = problem.grippers(Grips.of(*ends))
    collision = CollisionConstraint(problem.limits.keep_out)
    collision.scene = ObstacleScene(problem.solid)
    slacks: dict[str, Slacks] = {}
    bodies: dict[int, Spheres] = {}
    for end, arm in cell.arms.items():
        rows = [cell.joints[end]]
        for k in range(1, len(ends)):
            first, last = (grips.pair(j)[end] for j in (k - 1, k))
            joints = rows[-1]
            for share in np.linspace(0.0, 1.0, STEPS_TO_GOAL + 1)[1:]:
                solution = arm.solve(interpolate(first, last, float(share)), joints)
                if solution is None:
                    return None
                joints = solution
            rows.append(joints)
        path = np.array(rows)
        low, high = arm.joint_range
        links = Spheres(*arm.link_spheres(path))
        slacks[SIDES[end]] = {
            "joint_limits": np.min(np.minimum(path - low, high - path), axis=1),
            "singularity": singularity_slack(arm, path),
            **collision.slacks(links.centres, links.radii),
        }
        centres, radii = arm.base_spheres
        base = np.broadcast_to(centres, (len(path), *centres.shape))
        bodies[end] = Spheres.joined([links, Spheres(base, radii)])
    slacks[""] = {"spacing": _spacing_slack(problem, cell, grips, bodies)}
    return slacks


def _spacing_slack(
    problem: Problem, cell: CellArms, grips: Grips, arms: dict[int, Spheres]
) -> Float64[np.ndarray, "k"]:
    """Slack of the distance between both ends, each with its gripper, and its arm if it has one."""
    left, right = (
        Spheres.joined([cell.gripper_spheres(end, grips), *([arms[end]] if end in arms else [])])
        for end in (0, 1)
    )
    return body_spacing_slack(left, right, problem.limits.keep_out)
