"""Conversion between the messages of the bus and the values of the cell."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from lariat.safety.guard.consent import SignOfLife
from lariat.safety.guard.operator_commands import Action, OperatorCommand
from lariat.safety.motion.joint_trajectory import JointPoints
from lariat.scenario import SIDES, Side
from lariat.trajectory import NANOSECONDS, SetpointChunk
from services.robot_gateway.drivers.driver import ArmFeedback, Driver
from services.robot_gateway.status import CellStatus
from services.robot_gateway.trajectory_control import TrajectoryRequest
from shared.messages import (
    ArmCommand,
    ArmState,
    ArmStates,
    Consent,
    JointTrajectory,
    Setpoints,
)
from shared.runtime.service import Received

ACTION_NAMES: dict[int, Action] = {
    ArmCommand.ARM: "arm",
    ArmCommand.APPROACH: "approach",
    ArmCommand.DISARM: "disarm",
    ArmCommand.HOLD: "hold",
    ArmCommand.ACKNOWLEDGE: "acknowledge",
    ArmCommand.RESUME: "resume",
    ArmCommand.GRIPPER: "gripper",
}
"""Actions by their codes in a message."""
MODE_CODES = {
    "disarmed": ArmStates.DISARMED,
    "armed": ArmStates.ARMED,
    "moving": ArmStates.MOVING,
    "holding": ArmStates.HOLDING,
    "fault": ArmStates.FAULT,
}
"""Codes in a message by mode."""
TRAJECTORY_CODES = {
    "": ArmStates.NO_TRAJECTORY,
    "executing": ArmStates.EXECUTING,
    "reached": ArmStates.REACHED,
    "cancelled": ArmStates.CANCELLED,
    "refused": ArmStates.REFUSED,
    "stopped": ArmStates.STOPPED,
}
"""Codes in a message by the state of a trajectory."""


def chunk_of(message: Setpoints, sides: Sequence[Side]) -> SetpointChunk:
    """Return the setpoints for the named ends, in their order; they are validated later.

    Lists of lengths that do not match become empty ones, which validation refuses.
    """
    setpoints = {arm.arm: arm for arm in message.arms}
    columns = []
    for side in sides:
        arm = setpoints.get(side)
        p = np.array(arm.positions if arm else [], dtype=float)
        q = np.array(arm.orientations if arm else [], dtype=float)
        columns.append((p.reshape(-1, 3) if p.size % 3 == 0 else p[:0].reshape(-1, 3), q))
    count = len(columns[0][0]) if columns else 0
    fits = all(len(p) == count and q.size == 4 * count for p, q in columns)
    shape = (count if fits else 0, len(sides))
    positions, orientations = np.zeros((*shape, 3)), np.zeros((*shape, 4))
    if fits:
        for k, (p, q) in enumerate(columns):
            positions[:, k], orientations[:, k] = p, q.reshape(-1, 4)
    return SetpointChunk(message.t0, message.dt * NANOSECONDS, positions, orientations)


def command_of(item: Received) -> OperatorCommand:
    """Return the command of a message."""
    message: ArmCommand = item.message
    return OperatorCommand(
        id=message.id,
        boot=message.boot,
        answers=message.answers,
        action=ACTION_NAMES[message.action],
        arm=message.arm,
        close=message.close,
        distance=message.approach_distance,
        angle=message.approach_angle,
        session=message.session,
    )


def hold_of(item: Received) -> OperatorCommand:
    """Return the hold of a message of `arm/hold`, of which only the id counts."""
    return OperatorCommand(item.message.id, "", 0, "hold", origin="a ROS 2 node")


def trajectory_of(item: Received) -> TrajectoryRequest:
    """Return the trajectory, sign of life or cancellation of a message."""
    message: JointTrajectory = item.message
    count, points = len(message.times), {}
    for arm in message.arms:
        velocities = np.reshape(arm.velocities, (count, -1)) if arm.velocities else None
        points[arm.arm] = JointPoints(np.reshape(arm.positions, (count, -1)), velocities)
    times = NANOSECONDS * np.array(message.times, float)
    return TrajectoryRequest(message.id, times, points, message.cancel)


def sign_of_life_of(item: Received) -> SignOfLife:
    """Return the sign of life of a message."""
    message: Consent = item.message
    return SignOfLife(message.command, message.boot, message.sequence, message.answers)


def arm_states(status: CellStatus, drivers: Sequence[Driver], now: int) -> ArmStates:
    """Return the message of a cell's status."""
    safety = status.safety
    ends = zip(SIDES, drivers, status.arms, status.tracking, strict=True)
    trajectory, state, reason = status.trajectory
    answer = ArmStates(
        stamp=now,
        boot=safety.boot,
        mode=MODE_CODES[safety.mode],
        reason="; ".join(words for words in (safety.detail, status.remarks) if words),
        rule=status.rule or "",
        needs_acknowledgement=safety.needs_acknowledgement,
        session=safety.session,
        sequence=status.sequence,
        refused_sequence=status.refused_sequence,
        last_command=status.command,
        refusal=status.rejection,
        chunk_refusal=status.refusal,
        arms=[_arm_state(*end) for end in ends],
        braking=status.braking,
        reset_count=status.reset_count,
        cause=safety.cause,
        may_move=safety.may_move,
        needs_resume=safety.needs_resume,
        next_session=status.next_session,
        needs_approach=status.needs_approach,
        approaching=status.approaching,
        approach_distance=status.approach_distance,
        approach_angle=status.approach_angle,
        reaches_hardware=any(driver.reaches_hardware for driver in drivers),
        slow_pauses=status.pauses,
        trajectory=trajectory,
        trajectory_state=TRAJECTORY_CODES[state],
        trajectory_reason=reason,
    )
    if state == "executing":
        for arm, driver in zip(answer.arms, drivers, strict=True):
            if driver.joint_constraints is not None and driver.joint_constraints.joints is not None:
                arm.commanded_joints.extend(driver.joint_constraints.joints.tolist())
    return answer


def _arm_state(
    side: Side, driver: Driver, feedback: ArmFeedback, tracking: tuple[float, float]
) -> ArmState:
    linear, angular = feedback.velocity.tolist()
    state = ArmState(
        arm=side,
        driver=driver.name,
        linear_velocity=linear,
        angular_velocity=angular,
        joints=feedback.joints,
        gripper_closed=feedback.gripper_closed,
        alarms=feedback.alarms,
        tracking_error=tracking[0],
        tracking_angle=tracking[1],
        link_age=feedback.age,
        mode=feedback.mode,
        link_rate=feedback.link_rate,
        link_gap=feedback.link_gap,
        pull=feedback.contact_force,
        powered=feedback.powered,
    )
    if feedback.wrench is not None:
        force, torque = feedback.wrench
        state.force.extend(force.tolist())
        if np.all(np.isfinite(torque)):
            state.torque.extend(torque.tolist())
    if feedback.pose is not None:
        state.position.extend(feedback.pose.position.tolist())
        state.orientation.extend(feedback.pose.orientation.tolist())
    return state
