"""Checks of messages between the controller, a person and the arms."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

from shared import messages
from shared.messages.checks.values import (
    MAX_MAGNITUDE,
    Checks,
    check_integer,
    check_length,
    check_places,
    check_rotation,
    count_points,
)

MAX_TRAJECTORY_POINTS = 1000
"""Most points of a trajectory of the joints."""
_ARM_MODES = frozenset(messages.ArmStates.Mode.values())
_ARM_LENGTHS = ((3, 4, 3, 3), (3, 4, 0, 0), (0, 0, 3, 3), (0, 0, 0, 0))
"""Lengths of an arm's position, orientation and velocities, as far as they are known."""


def _check_arms(names: Sequence[str]) -> None:
    if len(set(names)) < len(names) or not set(names) <= {"left", "right"}:
        raise ValueError(f"arms are {list(names)}; each is 'left' or 'right', once")


def _check_setpoints(message: messages.Setpoints) -> None:
    for name in ("stamp", "sequence", "t0", "dt", "image_stamp"):
        check_integer(name, getattr(message, name))
    _check_arms([arm.arm for arm in message.arms])
    for arm in message.arms:
        count = count_points("positions", arm.positions)
        check_length("orientations", arm.orientations, 4 * count)


def _check_arm_states(message: messages.ArmStates) -> None:
    check_integer("stamp", message.stamp)
    check_integer("sequence", message.sequence)
    check_integer("refused_sequence", message.refused_sequence)
    check_integer("reset_count", message.reset_count)
    if message.mode not in _ARM_MODES:
        raise ValueError(f"mode = {message.mode} is not a value of the enum")
    arms = message.arms
    _check_arms([arm.arm for arm in arms])
    if len(arms) != 2:
        raise ValueError(f"{len(arms)} arms; a cell has two ends")
    for arm in arms:
        # Published at every step: lists are read fast, and their sum is taken in one pass in C.
        position, orientation = arm.position[:], arm.orientation[:]
        linear, angular = arm.linear_velocity[:], arm.angular_velocity[:]
        lengths = (len(position), len(orientation), len(linear), len(angular))
        if lengths not in _ARM_LENGTHS:
            raise ValueError(
                f"position, orientation and velocities of {arm.arm!r} have {list(lengths)} values; "
                "they take 3, 4, 3 and 3"
            )
        check_rotation("orientation", orientation)
        check_places("position", position)
        # A comparison with a number that is none is false.
        values = position + orientation + linear + angular + arm.joints[:]
        values += arm.commanded_joints[:] + arm.force[:] + arm.torque[:]
        if not sum(map(abs, values)) <= MAX_MAGNITUDE:
            raise ValueError(f"a vector of {arm.arm!r} holds a number beyond ±1e6, or none")


def _check_trajectory(message: messages.JointTrajectory) -> None:
    times, arms = message.times, message.arms
    if len(times) > MAX_TRAJECTORY_POINTS:
        raise ValueError(f"{len(times)} points; a trajectory has up to {MAX_TRAJECTORY_POINTS}")
    if any(b <= a for a, b in pairwise([-1, *times])):
        raise ValueError("times do not increase")
    _check_arms([arm.arm for arm in arms])
    if bool(times) != bool(arms):
        raise ValueError("a trajectory has both points and arms, or neither")
    for arm in arms:
        width = len(arm.positions) // len(times)
        check_length("positions", arm.positions, max(width, 1) * len(times))
        check_length("velocities", arm.velocities, 0, len(arm.positions))


def _check_arm_command(message: messages.ArmCommand) -> None:
    if message.action == messages.ArmCommand.UNSPECIFIED:
        raise ValueError("the command names no action")
    for name in ("approach_distance", "approach_angle"):
        if not 0.0 <= getattr(message, name) <= MAX_MAGNITUDE:
            raise ValueError(f"{name} = {getattr(message, name)} is no distance or angle")


CHECKS: Checks = {
    messages.Setpoints: _check_setpoints,
    messages.ArmStates: _check_arm_states,
    messages.ArmCommand: _check_arm_command,
    messages.JointTrajectory: _check_trajectory,
}
"""Check of each type of message."""
