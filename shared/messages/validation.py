"""Validity of messages from the bus: whoever may publish, nobody may end a process with a message.

Checks that hold for every message (payload size, known enum values, finite vectors, bounded
integers, texts and counts) follow from the descriptors; lengths that must fit each other have a
check for each message type. Numbers of setpoints are left to the gateway, which refuses them by the
name of a rule.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from foxglove_schemas_protobuf.CameraCalibration_pb2 import CameraCalibration
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage
from google.protobuf.descriptor import FieldDescriptor
from google.protobuf.message import DecodeError, Message

from lariat.geometry import polylines
from lariat.geometry.obstacle_checks import check_obstacle
from shared import messages
from shared.image_header import MAX_PIXEL_COUNT, check_image
from shared.motion_contract import SETPOINT_PERIOD
from shared.topics import Topic

MAX_STREAMED_SIZE = 256 * 1024
"""Largest payload of the messages that are published at every step [bytes]."""
MAX_COUNT = 200_000
"""Largest number of values of a field; a path of 2 m of rope has 54 000."""
MAX_TEXT_LENGTH = 4096
"""Largest number of characters of a text."""
MAX_INTEGER = 2**62
"""Largest magnitude of an integer; sums and differences of two stamps stay in 64 bits."""
MAX_NODES = 2000
"""Largest number of nodes of a rope."""
MAX_OBSTACLES = 256
"""Largest number of obstacles of a scene."""
MAX_OTHER_ROPES, MAX_LINES = 32, 64
"""Largest number of ropes beside the held one, and of lines of each."""
MAX_DIAMETER = 1.0
"""Largest diameter of a rope [m]."""
MAX_MAGNITUDE = 1e6
"""Magnitude above which a component of a vector is no length, speed or angle [SI]."""
MAX_DISTORTION_COUNT = 14
"""Largest number of distortion coefficients of a camera."""
MIN_PART_NODES = 3
"""Least number of nodes that give a part of a rope its shape [-]."""
MAX_COORDINATE = 100.0
"""Largest coordinate of a rope, goal or path [m]; the time and memory of a plan grow with it."""
MIN_PACE = 1e-3
"""Least pace of a path, as a fraction of the planner's [-]."""
MAX_TURNS = 1000.0
"""Largest twist of a goal or a rope [turns]."""
MAX_KNOTS = 256
"""Largest number of knots of a profile along the rope."""
MAX_CURVATURE = 1e4
"""Largest component of a rest curvature [1/m]."""
GRIP_ERROR_COUNT = 6
"""Number of components of an error of both grips."""
MAX_GRIP_OFFSET, MAX_GRIP_ROTATION = 0.1, 3.2
"""Largest component of the error of a grip [m, rad]."""
MATERIAL_BOUNDS = {
    "bending_stiffness": (1e-9, 1e6),
    "twist_ratio": (1e-3, 1e3),
    "damping": (0.0, 1e6),
    "length": (1e-3, 1e3),
}
"""Least and largest estimate of a rope's parameter [SI]."""
MAX_NORM_ERROR = 0.1
"""Largest deviation of a quaternion's norm from one [-]."""
SHORT_VECTOR = 32
"""Number of values from which an array is faster than a loop."""


def decode(topic: Topic, payload: bytes) -> Any:
    """Decode a message of a topic and check it.

    Args:
        topic: Row of the topic table.
        payload: Bytes of the message.

    Raises:
        ValueError: The bytes are no valid message of this topic; the text says why.
    """
    if len(payload) > topic.max_size:
        raise ValueError(f"{len(payload)} bytes, more than {topic.max_size}")
    try:
        message = topic.type.FromString(payload)
    except DecodeError as error:
        raise ValueError(f"its {len(payload)} bytes do not decode: {error}") from error
    if topic.type not in _COMPLETE_CHECKS:
        _check_fields(message)
    elif len(payload) > MAX_STREAMED_SIZE:
        raise ValueError(f"{len(payload)} bytes, more than {MAX_STREAMED_SIZE}")
    if check := _CHECKS.get(topic.type):
        check(message)
    return message


def _check_fields(message: Message) -> None:
    for field, value in message.ListFields():
        values = value if field.is_repeated else (value,)
        if len(values) > MAX_COUNT:
            raise ValueError(f"{field.name} has {len(values)} values, more than {MAX_COUNT}")
        if field.message_type is not None:
            if field.message_type.full_name == "google.protobuf.Timestamp":
                _check_integer(field.name, value.seconds * 10**9 + value.nanos)
            if not field.message_type.GetOptions().map_entry:
                for item in values:
                    _check_fields(item)
        elif field.enum_type is not None:
            for item in values:
                if item not in field.enum_type.values_by_number:
                    raise ValueError(f"{field.name} = {item} is not a value of the enum")
        else:
            _check_scalars(field, values)


def _check_scalars(field: FieldDescriptor, values: Sequence[Any]) -> None:
    match field.cpp_type:
        case FieldDescriptor.CPPTYPE_DOUBLE | FieldDescriptor.CPPTYPE_FLOAT:
            # Scalars may be infinite, such as the clearance in an empty scene.
            if field.is_repeated and not _all_within(values, MAX_MAGNITUDE):
                raise ValueError(f"{field.name} holds a number beyond ±{MAX_MAGNITUDE:g}, or none")
        case FieldDescriptor.CPPTYPE_INT64 | FieldDescriptor.CPPTYPE_UINT64:
            if any(abs(value) > MAX_INTEGER for value in values):
                raise ValueError(f"{field.name} holds an integer beyond ±2^62")
        case FieldDescriptor.CPPTYPE_STRING if field.type == FieldDescriptor.TYPE_STRING:
            if any(len(value) > MAX_TEXT_LENGTH for value in values):
                raise ValueError(f"{field.name} is longer than {MAX_TEXT_LENGTH} characters")


def _all_within(values: Sequence[float], bound: float) -> bool:
    # A slice of a field is a list, whose numbers are read ten times as fast. A comparison with a
    # number that is none is false, and the largest of several is none if one of them is.
    if len(values) < SHORT_VECTOR:
        return all(-bound <= value <= bound for value in values[:])
    return bool(np.abs(np.asarray(values)).max() <= bound)


def _check_length(name: str, values: Sequence[Any], *lengths: int) -> None:
    if len(values) not in lengths:
        expected = " or ".join(map(str, lengths))
        raise ValueError(f"{name} has {len(values)} values; it takes {expected}")


def _count_points(name: str, values: Sequence[float], width: int = 3) -> int:
    if len(values) % width:
        raise ValueError(f"{name} has {len(values)} values, not {width} a point")
    return len(values) // width


def _count_nodes(name: str, values: Sequence[float]) -> int:
    count = _count_points(name, values)
    if count == 1 or count > MAX_NODES:
        raise ValueError(f"{name} has {count} nodes; a rope has 2 to {MAX_NODES}")
    return count


def _check_places(name: str, values: Sequence[float]) -> None:
    """Check that coordinates lie in a cell."""
    if not _all_within(values, MAX_COORDINATE):
        raise ValueError(f"{name} holds a coordinate beyond ±{MAX_COORDINATE:g} m, or none")


def _check_bounded(name: str, values: Sequence[float]) -> None:
    if not _all_within(values, MAX_MAGNITUDE):
        raise ValueError(f"{name} holds a number beyond ±{MAX_MAGNITUDE:g}, or none")


def _check_integer(name: str, value: int) -> None:
    if abs(value) > MAX_INTEGER:
        raise ValueError(f"{name} holds an integer beyond ±2^62")


def _check_node_chain(message: messages.NodeChain) -> None:
    _check_integer("stamp", message.stamp)
    count = _count_nodes("positions", message.positions)
    _check_places("positions", message.positions)
    _check_bounded("sigma", message.sigma)
    _check_length("sigma", message.sigma, 0, count)
    _check_length("observed", message.observed, 0, count)
    if not 0.0 <= message.doubt <= 1.0:
        raise ValueError(f"doubt = {message.doubt:g} is no probability")


def _check_other_ropes(message: messages.OtherRopes) -> None:
    if len(message.ropes) > MAX_OTHER_ROPES:
        raise ValueError(f"{len(message.ropes)} other ropes, more than {MAX_OTHER_ROPES}")
    for rope in message.ropes:
        if not 0.0 < rope.diameter <= MAX_DIAMETER:
            raise ValueError(f"diameter = {rope.diameter:g} m is not within 0…{MAX_DIAMETER:g} m")
        if not 0.0 <= rope.doubt <= 1.0:
            raise ValueError(f"doubt = {rope.doubt:g} is no probability")
        if len(rope.lines) > MAX_LINES:
            raise ValueError(f"{len(rope.lines)} lines, more than {MAX_LINES}")
        for line in rope.lines:
            _count_nodes("positions", line.positions)
            _check_places("positions", line.positions)


def _check_arms(names: Sequence[str]) -> None:
    if len(set(names)) < len(names) or not set(names) <= {"left", "right"}:
        raise ValueError(f"arms are {list(names)}; each is 'left' or 'right', once")


def _check_setpoints(message: messages.Setpoints) -> None:
    for name in ("stamp", "sequence", "t0", "dt", "image_stamp"):
        _check_integer(name, getattr(message, name))
    _check_arms([arm.arm for arm in message.arms])
    for arm in message.arms:
        count = _count_points("positions", arm.positions)
        _check_length("orientations", arm.orientations, 4 * count)


def _check_arm_states(message: messages.ArmStates) -> None:
    _check_integer("stamp", message.stamp)
    _check_integer("sequence", message.sequence)
    _check_integer("refused_sequence", message.refused_sequence)
    _check_integer("reset_count", message.reset_count)
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
        _check_rotation("orientation", orientation)
        _check_places("position", position)
        # A comparison with a number that is none is false.
        values = position + orientation + linear + angular + arm.joints[:]
        if not sum(map(abs, values)) <= MAX_MAGNITUDE:
            raise ValueError(f"a vector of {arm.arm!r} holds a number beyond ±1e6, or none")


def _check_arm_command(message: messages.ArmCommand) -> None:
    if message.action == messages.ArmCommand.UNSPECIFIED:
        raise ValueError("the command names no action")
    for name in ("approach_distance", "approach_angle"):
        if not 0.0 <= getattr(message, name) <= MAX_MAGNITUDE:
            raise ValueError(f"{name} = {getattr(message, name)} is no distance or angle")


def _check_rotation(name: str, values: Sequence[float]) -> None:
    """Check a quaternion, if there is one."""
    if values and not abs(math.hypot(*values) - 1.0) <= MAX_NORM_ERROR:
        raise ValueError(f"{name} has norm {math.hypot(*values):g}; a rotation has norm 1")


def _check_rotations(name: str, values: Sequence[float]) -> None:
    norms = np.linalg.norm(np.reshape(values, (-1, 4)), axis=1)
    if not np.all(np.abs(norms - 1.0) <= MAX_NORM_ERROR):
        raise ValueError(f"{name} holds a quaternion that is no rotation; its norm must be 1")


def _check_grip(name: str, grip: messages.Grip) -> None:
    _check_length(f"{name}.position", grip.position, 0, 3)
    _check_length(f"{name}.orientation", grip.orientation, 0, 4)
    _check_places(f"{name}.position", grip.position)
    _check_rotation(f"{name}.orientation", grip.orientation)


def _check_turns(turns: float) -> None:
    if not abs(turns) <= MAX_TURNS:
        raise ValueError(f"turns = {turns:g}, beyond ±{MAX_TURNS:g}")


def check_goal(goal: messages.Goal) -> None:
    """Check the lengths and the places of a goal.

    Raises:
        ValueError: A length does not fit, or a coordinate lies outside of any cell.
    """
    _count_nodes("goal.positions", goal.positions)
    _check_places("goal.positions", goal.positions)
    _check_turns(goal.turns)
    if goal.part and goal.ends_only:
        raise ValueError("goal.part and goal.ends_only exclude each other")
    if goal.part:
        _check_length("goal.part", goal.part, 2)
        counted = polylines.within(messages.chain(goal.positions), *goal.part)
        if np.sum(counted) < MIN_PART_NODES:
            raise ValueError(
                f"goal.part = {list(goal.part)} m holds {np.sum(counted)} of the goal's nodes, "
                f"less than {MIN_PART_NODES}"
            )
    _check_grip("goal.left", goal.left)
    _check_grip("goal.right", goal.right)


def _check_task_state(message: messages.TaskState) -> None:
    check_goal(message.goal)
    if message.goal.positions:
        _check_whole_grips(message.goal)
    _check_turns(message.turns)
    if message.pace and not MIN_PACE <= message.pace <= 1.0:
        raise ValueError(f"pace = {message.pace:g} is not within {MIN_PACE:g}…1")
    if not 0.0 <= message.clearance_margin <= MAX_COORDINATE:
        raise ValueError(f"clearance_margin = {message.clearance_margin:g} m")


def _check_with_goal(
    message: messages.TaskRequest | messages.GoalPreview | messages.GoalListRequest,
) -> None:
    check_goal(message.goal)


def _check_goal_list(message: messages.GoalList) -> None:
    for saved in message.goals:
        check_goal(saved.goal)


def _check_draft(draft: messages.GoalDraft) -> None:
    _check_whole_grips(draft)
    _check_turns(draft.turns)
    if draft.pull:
        _check_length("pull", draft.pull, 3)
        _check_places("pull", draft.pull)


def _check_whole_grips(message: messages.Goal | messages.GoalDraft) -> None:
    for name, grip in (("left", message.left), ("right", message.right)):
        _check_length(f"{name}.position", grip.position, 3)
        _check_length(f"{name}.orientation", grip.orientation, 4)
        _check_places(f"{name}.position", grip.position)
        _check_rotation(f"{name}.orientation", grip.orientation)


def _check_path(message: messages.Path) -> None:
    count = _count_points("left_positions", message.left_positions)
    _check_length("right_positions", message.right_positions, 3 * count)
    _check_length("left_orientations", message.left_orientations, 4 * count)
    _check_length("right_orientations", message.right_orientations, 4 * count)
    _check_places("left_positions", message.left_positions)
    _check_places("right_positions", message.right_positions)
    _check_rotations("left_orientations", message.left_orientations)
    _check_rotations("right_orientations", message.right_orientations)
    _check_length("nodes", message.nodes, 3 * message.node_count * count)
    if count and message.dt != SETPOINT_PERIOD:
        raise ValueError(f"dt = {message.dt} ns; a path takes {SETPOINT_PERIOD} ns")


def _check_parameters(message: messages.Parameters) -> None:
    rod = message.rod
    for name, (low, high) in MATERIAL_BOUNDS.items():
        if rod.HasField(name):
            _check_estimate(f"rod.{name}", getattr(rod, name), low, high)
    profiles = (
        ("rod.stiffness_profile", rod.stiffness_profile, MAX_KNOTS, 1e-6, 1e6),
        ("rod.rest_curvature", rod.rest_curvature, 3 * MAX_KNOTS, -MAX_CURVATURE, MAX_CURVATURE),
        ("rod.grip_offset", rod.grip_offset, GRIP_ERROR_COUNT, -MAX_GRIP_OFFSET, MAX_GRIP_OFFSET),
        (
            "rod.grip_rotation",
            rod.grip_rotation,
            GRIP_ERROR_COUNT,
            -MAX_GRIP_ROTATION,
            MAX_GRIP_ROTATION,
        ),
    )
    for name, estimates, max_count, low, high in profiles:
        if len(estimates) > max_count:
            raise ValueError(f"{name} has {len(estimates)} values, more than {max_count}")
        for estimate in estimates:
            _check_estimate(name, estimate, low, high)
    _count_points("rod.rest_curvature", rod.rest_curvature)
    for name, estimates in (
        ("rod.grip_offset", rod.grip_offset),
        ("rod.grip_rotation", rod.grip_rotation),
    ):
        if estimates:
            _check_length(name, estimates, GRIP_ERROR_COUNT)


def _check_estimate(name: str, estimate: messages.Estimate, low: float, high: float) -> None:
    if not low <= estimate.value <= high:
        raise ValueError(f"{name} = {estimate.value:g} is not within {low:g}…{high:g}")
    if not 0.0 <= estimate.standard_deviation <= MAX_MAGNITUDE:
        raise ValueError(f"{name} has the standard deviation {estimate.standard_deviation:g}")


def _check_plan(message: messages.Plan) -> None:
    for name in ("stamp", "dt"):
        _check_integer(name, getattr(message, name))
    _check_bounded("nodes", message.nodes)
    if message.node_count > MAX_NODES or len(message.nodes) % max(3 * message.node_count, 1):
        raise ValueError(f"{len(message.nodes)} values are no chains of {message.node_count} nodes")


def _check_scene(message: messages.Scene) -> None:
    if len(message.obstacles) > MAX_OBSTACLES:
        raise ValueError(f"{len(message.obstacles)} obstacles, more than {MAX_OBSTACLES}")
    for obstacle in messages.scene_obstacles(message):
        check_obstacle(obstacle)


def _check_run_curves(message: messages.RunCurves) -> None:
    count = len(message.time)
    _check_length("error", message.error, count)
    _check_length("clearance", message.clearance, count)


def _check_run_motion(message: messages.RunMotion) -> None:
    if message.node_count == 1 or message.node_count > MAX_NODES:
        raise ValueError(f"node_count = {message.node_count}; a rope has 2 to {MAX_NODES}")
    _check_length("nodes", message.nodes, 3 * message.node_count * len(message.time))
    _check_places("nodes", message.nodes)
    _count_nodes("goal", message.goal)
    _check_places("goal", message.goal)


def _check_campaign_state(message: messages.CampaignState) -> None:
    for trial in message.trials:
        _check_length(f"values of seed {trial.seed}", trial.values, len(message.keys))


def _check_scene_motion(message: messages.SceneMotion) -> None:
    if len(message.motions) > MAX_OBSTACLES:
        raise ValueError(f"{len(message.motions)} motions, more than {MAX_OBSTACLES}")
    for motion in message.motions:
        _check_length(f"{motion.name!r}: position", motion.position, 3)
        _check_length(f"{motion.name!r}: velocity", motion.velocity, 3)
        _check_length(f"{motion.name!r}: waypoints", motion.waypoints, 3 * len(motion.times))
        _check_places(f"{motion.name!r}: position", motion.position)
        _check_places(f"{motion.name!r}: waypoints", motion.waypoints)
    messages.obstacle_motions(message)


def _check_color(message: CompressedImage) -> None:
    check_image(message.data)


def _check_pixel_count(width: int, height: int) -> None:
    if not 0 < width * height <= MAX_PIXEL_COUNT:
        raise ValueError(f"{width} x {height} pixels; an image has 1 to {MAX_PIXEL_COUNT}")


def _check_depth(message: RawImage) -> None:
    _check_pixel_count(message.width, message.height)


def _check_calibration(message: CameraCalibration) -> None:
    _check_pixel_count(message.width, message.height)
    _check_length("K", message.K, 9)
    if not (message.K[0] > 0.0 and message.K[4] > 0.0):
        raise ValueError(f"focal lengths are {message.K[0]:g} and {message.K[4]:g} pixels")
    if len(message.D) > MAX_DISTORTION_COUNT:
        raise ValueError(f"D has {len(message.D)} values, more than {MAX_DISTORTION_COUNT}")


_CHECKS: dict[type[Message], Callable[[Any], None]] = {
    messages.NodeChain: _check_node_chain,
    messages.OtherRopes: _check_other_ropes,
    messages.Setpoints: _check_setpoints,
    messages.ArmStates: _check_arm_states,
    messages.ArmCommand: _check_arm_command,
    messages.TaskState: _check_task_state,
    messages.TaskRequest: _check_with_goal,
    messages.GoalPreview: _check_with_goal,
    messages.GoalListRequest: _check_with_goal,
    messages.GoalList: _check_goal_list,
    messages.GoalDraft: _check_draft,
    messages.Path: _check_path,
    messages.Parameters: _check_parameters,
    messages.Plan: _check_plan,
    messages.Scene: _check_scene,
    messages.RunCurves: _check_run_curves,
    messages.RunMotion: _check_run_motion,
    messages.CampaignState: _check_campaign_state,
    messages.SceneMotion: _check_scene_motion,
    CompressedImage: _check_color,
    RawImage: _check_depth,
    CameraCalibration: _check_calibration,
}
_COMPLETE_CHECKS = {messages.ArmStates, messages.NodeChain, messages.Plan, messages.Setpoints}
"""Types whose own check leaves nothing to the general one: those of every step."""
_ARM_MODES = frozenset(messages.ArmStates.Mode.values())
_ARM_LENGTHS = ((3, 4, 3, 3), (3, 4, 0, 0), (0, 0, 3, 3), (0, 0, 0, 0))
"""Lengths of an arm's position, orientation and velocities, as far as they are known."""
