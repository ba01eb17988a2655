"""Check of a whole motion against every rule of a scenario's cell, as the gateway checks chunks."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float64

from lariat.geometry.grippers import gripper_bodies
from lariat.geometry.obstacles import Obstacle
from lariat.geometry.poses import Pose
from lariat.safety.constraints.joints import JointConstraints
from lariat.safety.constraints.motion_constraints import CellBoundaries
from lariat.safety.motion.follower import SetpointFollower
from lariat.scenario import SIDES, Scenario, Side
from lariat.trajectory import SetpointChunk


def boundaries_of(scenario: Scenario) -> CellBoundaries:
    """Return the boundaries of a scenario's cell."""
    limits = scenario.limits
    return CellBoundaries(
        rope_length=scenario.rope.length,
        workspace=limits.workspace,
        bodies=gripper_bodies(limits.gripper_reach, limits.gripper_radius),
        keep_out=limits.keep_out,
        spacing=limits.spacing,
        overstretch=limits.overstretch,
        regions=scenario.regions,
    )


def check_motion(
    scenario: Scenario,
    positions: Float64[np.ndarray, "t 2 3"],
    orientations: Float64[np.ndarray, "t 2 4"],
    dt: float,
    obstacles: Sequence[Obstacle] | None = None,
) -> None:
    """Check a motion of both grips, which begins and ends at rest, against every rule of a cell.

    Limits of speed, acceleration and jerk, workspace, regions, distances of grippers and arms from
    obstacles and from each other, stretch of the rope round obstacles, and the joints of arms that
    a URDF describes (extra `planning`).

    Args:
        scenario: Limits, arms and rope of the cell.
        positions: Positions of both grips, left first [m].
        orientations: Their orientations, unit quaternions wxyz.
        dt: Time between two poses [s].
        obstacles: Obstacles, no regions; those of the scenario by default.

    Raises:
        ChunkRefused: The motion breaks a rule; a ValueError whose `rule` names it.
    """
    starts = [Pose(p, q) for p, q in zip(positions[0], orientations[0], strict=True)]
    driven = [k for k, side in enumerate(SIDES) if scenario.end(side).driver != "fixed"]
    joints = [_joints(scenario, SIDES[k], starts[k]) for k in driven]
    follower = SetpointFollower(scenario.limits, boundaries_of(scenario), starts, driven, joints)
    follower.constraints.replace_obstacles(scenario.bodies if obstacles is None else obstacles)
    chunk = SetpointChunk(0, dt, positions[:, driven], orientations[:, driven])
    with follower.constraints.rope_length.finishing_searches():
        follower.check(chunk, 0)


def _joints(scenario: Scenario, side: Side, grip: Pose) -> JointConstraints | None:
    """Joint constraints of an end's arm at a grip; None where no URDF describes one."""
    if scenario.end(side).driver in ("fixed", "ideal"):
        return None
    # Only a cell with arms needs Pinocchio.
    from lariat.arms.installation import kinematics_of

    kinematics = kinematics_of(scenario, side)
    if kinematics is None:
        return None
    made, angles = JointConstraints(kinematics, scenario.limits), kinematics.solve_anywhere(grip)
    if angles is not None:
        made.set_joints(tuple(angles))
    return made
