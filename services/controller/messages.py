"""Between the controller's own words and the messages of the bus."""

from __future__ import annotations

import numpy as np

from lariat.geometry import polylines
from lariat.geometry.obstacles import Obstacle
from lariat.rod.xpbd import PARAMETERS
from lariat.trajectory import MotionState, SetpointChunk
from services.controller.mpc.receding_horizon import Command
from services.controller.mpc.reference_trajectory import ReferenceTrajectory
from services.controller.paper.adaptation import PaperAdaptation
from services.controller.run.goals import GoalFactory
from services.controller.run.task import Goal
from shared import messages
from shared.messages import ArmSetpoints, ArmStates, Path, Plan, Setpoints, arm_pose, chain
from shared.motion_contract import SETPOINT_PERIOD
from shared.scenario import SIDES

STATES = {
    "idle": messages.IDLE,
    "running": messages.RUNNING,
    "paused": messages.PAUSED,
    "reached": messages.REACHED,
    "failed": messages.FAILED,
}


def motion_of(arms: ArmStates) -> MotionState:
    """What both grips do."""
    rest = MotionState.at_rest(arm_pose(arms, "left"), arm_pose(arms, "right"))
    twists = np.zeros((2, 2, 3))
    for state in arms.arms:
        row = twists[SIDES.index("left" if state.arm == "left" else "right")]
        if state.linear_velocity:
            row[0] = state.linear_velocity
        if state.angular_velocity:
            row[1] = state.angular_velocity
    return MotionState(rest.positions, rest.orientations, twists, rest.accelerations)


def goal_message(goal: Goal) -> messages.Goal:
    """The message of a goal."""
    return messages.Goal(
        positions=goal.nodes.ravel(),
        left=messages.grip(goal.left),
        right=messages.grip(goal.right),
        left_oriented=goal.left_oriented,
        right_oriented=goal.right_oriented,
        turns=goal.turns,
    )


def goal_of(message: messages.Goal, maker: GoalFactory, obstacles: tuple[Obstacle, ...]) -> Goal:
    """The goal of a request: by its nodes, or the rod at rest between its grips."""
    if not message.positions:
        left, right = messages.grip_pose(message.left), messages.grip_pose(message.right)
        return maker.between(*maker.held(left, right), obstacles, message.turns)
    nodes = chain(message.positions)
    count = maker.scenario.rope.node_count
    if len(nodes) != count and len(nodes) >= 3:
        nodes = polylines.resample(nodes, count)
    grips = maker.start
    if message.left.position and message.right.position:
        grips = messages.grip_pose(message.left), messages.grip_pose(message.right)
    held = maker.held(*grips)
    return Goal(nodes, *held, message.left_oriented, message.right_oriented, message.turns)


def chunk_message(
    chunk: SetpointChunk, now: int, session: str, sequence: int, image_stamp: int
) -> Setpoints:
    """The setpoints of a chunk."""
    arms = [
        ArmSetpoints(
            arm=side,
            positions=chunk.positions[:, k].ravel(),
            orientations=chunk.orientations[:, k].ravel(),
        )
        for k, side in enumerate(SIDES)
    ]
    return Setpoints(
        stamp=now,
        session=session,
        sequence=sequence,
        t0=chunk.start,
        dt=SETPOINT_PERIOD,
        arms=arms,
        image_stamp=image_stamp,
    )


def plan_message(command: Command, dt: int) -> Plan:
    """What is expected of the horizon; its first chain is one step ahead of the plan's start."""
    return Plan(
        stamp=command.plan_start + dt,
        dt=dt,
        node_count=command.plan.nodes.shape[1],
        nodes=command.plan.nodes.ravel(),
        cost=command.plan.cost,
        iterations=command.plan.iterations,
    )


def reference_trajectory(path: Path) -> ReferenceTrajectory:
    """A planned path as the controller follows it."""
    if path.dt != SETPOINT_PERIOD:
        raise ValueError(
            f"a path's points are {path.dt} ns apart; setpoints take {SETPOINT_PERIOD} ns"
        )
    left, right = chain(path.left_positions), chain(path.right_positions)
    turned = [
        np.asarray(q, dtype=float).reshape(-1, 4)
        for q in (path.left_orientations, path.right_orientations)
    ]
    nodes = chain(path.nodes).reshape(len(left), path.node_count, 3)
    return ReferenceTrajectory(
        SETPOINT_PERIOD * 1e-9,
        np.stack([left, right], axis=1),
        np.stack(turned, axis=1),
        nodes,
        path.reached,
        path.reason,
        path.blocked,
    )


def paper_parameters(adaptation: PaperAdaptation, now: int, error: float) -> messages.Parameters:
    """The message of the paper's five parameters; its gradient descent knows no deviations.

    Args:
        error: Of the last prediction [m].
    """
    units = ("kg", "kg m^2", "", "", "m^2/N")
    return messages.Parameters(
        stamp=now,
        parameters=[
            messages.Parameter(name=name, value=getattr(adaptation.properties, name), unit=unit)
            for name, unit in zip(PARAMETERS, units, strict=True)
        ],
        prediction_error=error,
    )
