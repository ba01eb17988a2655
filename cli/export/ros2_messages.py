"""ROS 2 messages from those of a recording.

Frames, curves and bodies come from the drawing of the cell; images, calibrations and log lines have
a counterpart of their own; planned and commanded motion become trajectories of the grips.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from foxglove_schemas_protobuf.CameraCalibration_pb2 import CameraCalibration
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.JointStates_pb2 import JointStates
from foxglove_schemas_protobuf.Log_pb2 import Log
from foxglove_schemas_protobuf.PointCloud_pb2 import PointCloud
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate

from cli.export.ros2_markers import Markers
from cli.export.ros2_store import duration, header, quaternion, ros, time, vector
from shared.cell_description import GRIP, WORLD_FRAME, frame_name
from shared.messages import Path, Setpoints, from_timestamp

LOG_LEVELS = {
    Log.Level.DEBUG: 10,
    Log.Level.INFO: 20,
    Log.Level.WARNING: 30,
    Log.Level.ERROR: 40,
    Log.Level.FATAL: 50,
}
"""Levels of rcl_interfaces/Log."""
FLOAT32, UINT32 = 7, 6
"""Data types of sensor_msgs/PointField."""
POINT = np.dtype([("position", "<f4", 3), ("color", "u1", 4)])
"""Point of a drawn cloud, with red, green, blue, alpha."""

Converted = tuple[str, Any]
"""ROS 2 topic and message."""


def robot_description(urdf: str) -> Any:
    """Return the message with a URDF."""
    return ros("std_msgs/msg/String", data=urdf)


def converted(key: str, message: Any, markers: Markers) -> Iterator[Converted]:
    """Yield the ROS 2 messages that stand for a recorded one; none if it has no counterpart.

    Args:
        key: Key of its topic on the bus.
        message: The message.
        markers: Converter of the bodies and lines.
    """
    topic = f"/{key}"
    match message:
        case FrameTransforms():
            yield from _transforms(message)
        case JointStates():
            yield "/joint_states", _joint_state(message)
        case PointCloud():
            yield topic, _point_cloud(message)
        case SceneUpdate():
            yield "/view/markers", markers.converted(message)
        case CompressedImage():
            yield f"{topic}/compressed", _compressed_image(message)
        case RawImage():
            yield topic, _image(message)
        case CameraCalibration():
            yield topic.replace("/calibration", "/camera_info"), _camera_info(message)
        case Log():
            yield "/rosout", _log(message)
        case Path() if message.dt:
            yield topic, _path(message)
        case Setpoints() if message.arms:
            yield topic, _setpoints(message)


def _transforms(message: FrameTransforms) -> Iterator[Converted]:
    moving, static = [], []
    for t in message.transforms:
        transform = ros(
            "geometry_msgs/msg/TransformStamped",
            header=header(from_timestamp(t.timestamp), t.parent_frame_id),
            child_frame_id=t.child_frame_id,
            transform=_transform(
                (t.translation.x, t.translation.y, t.translation.z),
                (t.rotation.w, t.rotation.x, t.rotation.y, t.rotation.z),
            ),
        )
        fixed = t.parent_frame_id == WORLD_FRAME and not t.child_frame_id.endswith(f"/{GRIP}")
        (static if fixed else moving).append(transform)
    if moving:
        yield "/tf", ros("tf2_msgs/msg/TFMessage", transforms=moving)
    if static:
        yield "/tf_static", ros("tf2_msgs/msg/TFMessage", transforms=static)


def _transform(position: Any, orientation: Any) -> Any:
    return ros(
        "geometry_msgs/msg/Transform",
        translation=vector(position),
        rotation=quaternion(orientation),
    )


def _joint_state(message: JointStates) -> Any:
    return ros(
        "sensor_msgs/msg/JointState",
        header=header(from_timestamp(message.timestamp), ""),
        name=[joint.name for joint in message.joints],
        position=np.array([joint.position for joint in message.joints]),
        velocity=np.zeros(0),
        effort=np.zeros(0),
    )


def _point_cloud(message: PointCloud) -> Any:
    points = np.frombuffer(message.data, POINT).copy()
    # RViz takes the colour as one number, blue in its lowest byte.
    points["color"] = points["color"][:, [2, 1, 0, 3]]
    fields = [("x", 0, FLOAT32), ("y", 4, FLOAT32), ("z", 8, FLOAT32), ("rgba", 12, UINT32)]
    return ros(
        "sensor_msgs/msg/PointCloud2",
        header=header(from_timestamp(message.timestamp), message.frame_id),
        height=1,
        width=len(points),
        fields=[
            ros("sensor_msgs/msg/PointField", name=name, offset=offset, datatype=kind, count=1)
            for name, offset, kind in fields
        ],
        is_bigendian=False,
        point_step=POINT.itemsize,
        row_step=points.nbytes,
        data=points.view(np.uint8),
        is_dense=True,
    )


def _compressed_image(message: CompressedImage) -> Any:
    return ros(
        "sensor_msgs/msg/CompressedImage",
        header=header(from_timestamp(message.timestamp), message.frame_id),
        format=message.format,
        data=np.frombuffer(message.data, np.uint8),
    )


def _image(message: RawImage) -> Any:
    return ros(
        "sensor_msgs/msg/Image",
        header=header(from_timestamp(message.timestamp), message.frame_id),
        height=message.height,
        width=message.width,
        encoding=message.encoding,
        is_bigendian=0,
        step=message.step,
        data=np.frombuffer(message.data, np.uint8),
    )


def _camera_info(message: CameraCalibration) -> Any:
    region = ros(
        "sensor_msgs/msg/RegionOfInterest",
        x_offset=0,
        y_offset=0,
        height=0,
        width=0,
        do_rectify=False,
    )
    return ros(
        "sensor_msgs/msg/CameraInfo",
        header=header(from_timestamp(message.timestamp), message.frame_id),
        height=message.height,
        width=message.width,
        distortion_model=message.distortion_model,
        d=np.array(message.D),
        k=_filled(message.K, 9),
        r=_filled(message.R, 9),
        p=_filled(message.P, 12),
        binning_x=0,
        binning_y=0,
        roi=region,
    )


def _filled(values: Any, count: int) -> np.ndarray:
    return np.array(values, float) if len(values) == count else np.zeros(count)


def _log(message: Log) -> Any:
    return ros(
        "rcl_interfaces/msg/Log",
        stamp=time(from_timestamp(message.timestamp)),
        level=LOG_LEVELS.get(message.level, 0),
        name=message.name,
        msg=message.message,
        file=message.file,
        function="",
        line=message.line,
    )


def _path(message: Path) -> Any:
    poses = {
        "left": (message.left_positions, message.left_orientations),
        "right": (message.right_positions, message.right_orientations),
    }
    return _trajectory(poses, message.stamp, 0, message.dt)


def _setpoints(message: Setpoints) -> Any:
    poses = {arm.arm: (arm.positions, arm.orientations) for arm in message.arms}
    return _trajectory(poses, message.stamp, message.t0 - message.stamp, message.dt)


def _trajectory(poses: dict[str, tuple[Any, Any]], stamp: int, first: int, dt: int) -> Any:
    """Trajectory of the grips.

    Args:
        poses: Flat positions [m] and orientations wxyz by side.
        stamp: Time that the trajectory counts from [ns].
        first: Time of the first point [ns].
        dt: Time between two points [ns].
    """
    arrays = [
        (np.reshape(positions, (-1, 3)), np.reshape(orientations, (-1, 4)))
        for positions, orientations in poses.values()
    ]
    points = []
    for k in range(min(len(positions) for positions, _ in arrays)):
        after = first + k * dt
        points.append(
            ros(
                "trajectory_msgs/msg/MultiDOFJointTrajectoryPoint",
                transforms=[_transform(positions[k], turns[k]) for positions, turns in arrays],
                velocities=[],
                accelerations=[],
                time_from_start=duration(after),
            )
        )
    return ros(
        "trajectory_msgs/msg/MultiDOFJointTrajectory",
        header=header(stamp, WORLD_FRAME),
        joint_names=[frame_name(side, GRIP) for side in poses],
        points=points,
    )
