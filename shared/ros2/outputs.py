"""Table of what ROS 2 gets: topics of the bus, and the ROS 2 messages that stand for theirs.

Live cells and exports of recordings use the same table. Frames, curves and bodies come from the
drawing of the cell. Stamps are of the system's clock, in the frame `world` where a message has no
other.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial
from typing import Any

import cv2
import numpy as np
from foxglove_schemas_protobuf.CameraCalibration_pb2 import CameraCalibration
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.JointStates_pb2 import JointStates
from foxglove_schemas_protobuf.Log_pb2 import Log
from foxglove_schemas_protobuf.PointCloud_pb2 import PointCloud
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage
from jaxtyping import Float64

from lariat.geometry import polylines, poses
from lariat.scenario import SIDES, Side
from lariat.trajectory import SECOND
from shared import topics
from shared.cell_description import GRIP, WORLD_FRAME, frame_name
from shared.messages import (
    ArmStates,
    Health,
    NodeChain,
    OtherRopes,
    Path,
    Plan,
    RunState,
    Setpoints,
    TaskState,
    chain,
    from_timestamp,
    stamp_of,
)
from shared.ros2.markers import Markers
from shared.ros2.types import Rows, header, ros, time, vector
from shared.ros2.wire import LATCHED, SENSOR, Qos
from shared.topics import Topic

FLOAT32, UINT32 = 7, 6
"""Data types of sensor_msgs/PointField."""
XYZW = [1, 2, 3, 0]
"""Order of a quaternion wxyz in ROS 2."""
COLORED_POINT = np.dtype([("position", "<f4", 3), ("color", "u1", 4)])
"""Point of a drawn cloud, with red, green, blue, alpha."""


@dataclass(frozen=True)
class Output:
    """ROS 2 topic whose messages stand for those of a topic of the bus."""

    source: Topic
    """Topic of the bus."""
    name: str
    """Name of the ROS 2 topic; `{name}` is filled as in the source's key."""
    type: str
    """Type of its messages."""
    meaning: str
    """What it tells."""
    convert: Callable[[Any], Any | None]
    """Conversion of a message; None where nothing stands for it."""
    qos: Qos = Qos()
    """Quality of service."""
    recorded: bool = True
    """Whether exports of recordings have it as well."""
    rate: float | None = None
    """Largest rate at which it is published live [Hz]; without, that of the source."""

    def name_for(self, key: str) -> str:
        """Return the name for a concrete key of the source."""
        mine, other = self.source.key.split("/"), key.split("/")
        for part, value in zip(mine, other, strict=True):
            if part.startswith("{"):
                return self.name.replace("{name}", value)
        return self.name


def outputs(clock: Topic = topics.ROPE_TRUTH) -> tuple[Output, ...]:
    """Return the table, with converters of its own; those of markers have a state."""
    t = topics
    return (
        Output(t.VIEW_TRANSFORMS, "/tf", "tf2_msgs/msg/TFMessage",
               "frames of links and grips", partial(_frames, False), Qos(depth=100)),
        Output(t.VIEW_TRANSFORMS, "/tf_static", "tf2_msgs/msg/TFMessage",
               "frames of cameras and bases", partial(_frames, True), LATCHED),
        Output(t.VIEW_JOINTS, "/joint_states", "sensor_msgs/msg/JointState",
               "joint angles [rad]", _joint_state),
        Output(t.ROPE_NODES, "rope/points", "sensor_msgs/msg/PointCloud2",
               "rope: x, y, z, arc length s, standard deviation sigma [m]", _rope_points),
        Output(t.ROPE_NODES, "rope/poses", "geometry_msgs/msg/PoseArray",
               "rope's nodes from left to right, z along it", _rope_poses),
        Output(t.ROPE_OTHERS, "rope/others", "sensor_msgs/msg/PointCloud2",
               "other ropes: x, y, z [m], id", _other_ropes),
        Output(t.TASK_STATE, "goal/poses", "geometry_msgs/msg/PoseArray",
               "goal's nodes from left to right, z along it", _goal_poses),
        Output(t.CONTROLLER_PATH, "controller/path",
               "trajectory_msgs/msg/MultiDOFJointTrajectory", "planned path of the grips", _path),
        Output(t.CONTROLLER_PLAN, "controller/prediction", "geometry_msgs/msg/PoseArray",
               "rope at the end of the controller's horizon", _prediction, rate=30.0),
        Output(t.ARM_SETPOINTS, "arm/setpoints", "trajectory_msgs/msg/MultiDOFJointTrajectory",
               "commanded motion of the grips", _setpoints, rate=30.0),
        *(Output(t.ARM_STATE, f"arm/{side}/wrench", "geometry_msgs/msg/WrenchStamped",
                 f"force and torque on the {side} gripper", partial(_wrench, side), rate=30.0)
          for side in SIDES),
        Output(t.CAMERA_COLOR, "camera/{name}/color/image_raw", "sensor_msgs/msg/Image",
               "colour image", _decoded_image, SENSOR, recorded=False),
        Output(t.CAMERA_COLOR, "camera/{name}/color/image_raw/compressed",
               "sensor_msgs/msg/CompressedImage", "colour image", _compressed_image, SENSOR),
        Output(t.CAMERA_DEPTH, "camera/{name}/depth/image_raw", "sensor_msgs/msg/Image",
               "depth registered to colour [mm]", _image, SENSOR),
        Output(t.VIEW_POINTS, "camera/{name}/depth/points", "sensor_msgs/msg/PointCloud2",
               "drawing of the depth", _colored_points),
        Output(t.CAMERA_CALIBRATION, "camera/{name}/color/camera_info",
               "sensor_msgs/msg/CameraInfo", "intrinsics", _camera_info),
        Output(t.CAMERA_CALIBRATION, "camera/{name}/depth/camera_info",
               "sensor_msgs/msg/CameraInfo", "intrinsics", _camera_info),
        Output(t.VIEW_SCENE, "view/markers", "visualization_msgs/msg/MarkerArray",
               "drawing: rope, goal, path, obstacles, arms", Markers().converted),
        Output(clock, "/clock", "rosgraph_msgs/msg/Clock",
               "time of the simulated plant, for use_sim_time", _clock, Qos(False, depth=1),
               recorded=False),
        Output(t.HEALTH, "/diagnostics", "diagnostic_msgs/msg/DiagnosticArray",
               "health of the processes", _health),
        Output(t.TASK_STATE, "/diagnostics", "diagnostic_msgs/msg/DiagnosticArray",
               "state of the run, error and clearance [m]", _task),
        Output(t.LOG, "/rosout", "rcl_interfaces/msg/Log", "log", _log),
    )  # fmt: skip


def _frames(fixed: bool, message: FrameTransforms) -> Any | None:
    # A frame's translation and rotation have the fields of ROS 2's.
    transforms = [
        ros(
            "geometry_msgs/msg/TransformStamped",
            header=header(from_timestamp(t.timestamp), t.parent_frame_id),
            child_frame_id=t.child_frame_id,
            transform=t,
        )
        for t in message.transforms
        if fixed is (t.parent_frame_id == WORLD_FRAME and not t.child_frame_id.endswith(f"/{GRIP}"))
    ]
    return ros("tf2_msgs/msg/TFMessage", transforms=transforms) if transforms else None


def _joint_state(message: JointStates) -> Any:
    return ros(
        "sensor_msgs/msg/JointState",
        header=header(from_timestamp(message.timestamp), ""),
        name=[joint.name for joint in message.joints],
        position=np.array([joint.position for joint in message.joints]),
    )


def _rope_points(message: NodeChain) -> Any | None:
    nodes = chain(message.positions)
    if not len(nodes):
        return None
    sigma = message.sigma if len(message.sigma) == len(nodes) else np.full(len(nodes), np.nan)
    columns = np.column_stack([nodes, polylines.arc_lengths(nodes), sigma])
    return _cloud(message.stamp, columns, ("x", "y", "z", "s", "sigma"))


def _other_ropes(message: OtherRopes) -> Any:
    rows = [np.zeros((0, 4))]
    for rope in message.ropes:
        for line in rope.lines:
            points = chain(line.positions)
            rows.append(np.column_stack([points, np.full(len(points), rope.id)]))
    return _cloud(message.stamp, np.concatenate(rows), ("x", "y", "z", "id"))


def _cloud(stamp: int, columns: Float64[np.ndarray, "n k"], names: tuple[str, ...]) -> Any:
    """Cloud of points in the world with 32-bit numbers, a column for each name."""
    points = np.ascontiguousarray(columns, "<f4")
    return _point_cloud(header(stamp, WORLD_FRAME), points, tuple((n, FLOAT32) for n in names))


def _rope_poses(message: NodeChain) -> Any | None:
    return _pose_array(message.stamp, chain(message.positions))


def _goal_poses(message: TaskState) -> Any | None:
    return _pose_array(message.stamp, chain(message.goal.positions))


def _prediction(message: Plan) -> Any | None:
    return _pose_array(message.stamp, chain(message.nodes)[-message.node_count :])


def _pose_array(stamp: int, nodes: Float64[np.ndarray, "n 3"]) -> Any | None:
    """Poses of nodes, z along the chain."""
    if len(nodes) < 2:
        return None
    # Central differences, and those of the ends.
    padded = np.concatenate([nodes[:1], nodes, nodes[-1:]])
    tangents = poses.normalized(padded[2:] - padded[:-2])
    turns = poses.rotation_between(np.array([0.0, 0.0, 1.0]), tangents)
    rows = Rows((len(nodes),), np.hstack([nodes, turns[:, XYZW]]))
    return ros("geometry_msgs/msg/PoseArray", header=header(stamp, WORLD_FRAME), poses=rows)


def _colored_points(message: PointCloud) -> Any:
    points = np.frombuffer(message.data, COLORED_POINT).copy()
    # RViz takes the colour as one number, blue in its lowest byte.
    points["color"] = points["color"][:, [2, 1, 0, 3]]
    fields = ("x", FLOAT32), ("y", FLOAT32), ("z", FLOAT32), ("rgba", UINT32)
    return _point_cloud(header(from_timestamp(message.timestamp), message.frame_id), points, fields)


def _point_cloud(heading: Any, points: np.ndarray, fields: tuple[tuple[str, int], ...]) -> Any:
    """Cloud of rows of 4 bytes for each field, of which name and data type are given."""
    step = 4 * len(fields)
    return ros(
        "sensor_msgs/msg/PointCloud2",
        header=heading,
        height=1,
        width=len(points),
        fields=_point_fields(fields),
        point_step=step,
        row_step=len(points) * step,
        data=points.view(np.uint8).ravel(),
        is_dense=True,
    )


@cache
def _point_fields(fields: tuple[tuple[str, int], ...]) -> list[Any]:
    kind = "sensor_msgs/msg/PointField"
    return [
        ros(kind, name=name, offset=4 * k, datatype=datatype, count=1)
        for k, (name, datatype) in enumerate(fields)
    ]


def _compressed_image(message: CompressedImage) -> Any:
    return _picture("CompressedImage", message, message.data, format=message.format)


def _decoded_image(message: CompressedImage) -> Any | None:
    image = cv2.imdecode(np.frombuffer(message.data, np.uint8), cv2.IMREAD_COLOR)
    if image is None:
        return None
    height, width = image.shape[:2]
    size = {"height": height, "width": width, "step": 3 * width}
    return _picture("Image", message, image, encoding="bgr8", **size)


def _image(message: RawImage) -> Any:
    size = {"height": message.height, "width": message.width, "step": message.step}
    return _picture("Image", message, message.data, encoding=message.encoding, **size)


def _picture(kind: str, source: Any, data: Any, **fields: Any) -> Any:
    heading, content = (
        header(from_timestamp(source.timestamp), source.frame_id),
        np.frombuffer(data, np.uint8),
    )
    rows = Rows((content.size,), content, 1)
    return ros(f"sensor_msgs/msg/{kind}", header=heading, data=rows, **fields)


def _camera_info(message: CameraCalibration) -> Any:
    matrices = {"k": message.K, "r": message.R, "p": message.P}
    return ros(
        "sensor_msgs/msg/CameraInfo",
        header=header(from_timestamp(message.timestamp), message.frame_id),
        height=message.height,
        width=message.width,
        distortion_model=message.distortion_model,
        d=np.array(message.D),
        **{name: np.array(values) for name, values in matrices.items() if values},
    )


def _health(message: Health) -> Any:
    values = {
        "step_p99_ms": message.step_p99_ms,
        "period_ms": message.period_ms,
        "overruns": message.overruns,
        "drops": message.drops,
        "refused": message.refused,
    }
    return _diagnostics(message.stamp, message.service, message.note, bool(message.note), values)


def _task(message: TaskState) -> Any:
    values = {
        "state": RunState.Name(message.state),
        "error": message.error,
        "clearance": message.clearance,
        "goal_revision": message.goal_revision,
    }
    failed = message.state == RunState.Value("FAILED")
    return _diagnostics(message.stamp, "run", message.reason, failed, values)


def _diagnostics(stamp: int, name: str, text: str, warns: bool, values: dict[str, object]) -> Any:
    kind = "diagnostic_msgs/msg"
    status = ros(
        f"{kind}/DiagnosticStatus",
        level=1 if warns else 0,
        name=f"lariat: {name}",
        message=text,
        values=[ros(f"{kind}/KeyValue", key=key, value=f"{v}") for key, v in values.items()],
    )
    return ros(f"{kind}/DiagnosticArray", header=header(stamp, ""), status=[status])


def _log(message: Log) -> Any:
    return ros(
        "rcl_interfaces/msg/Log",
        stamp=time(from_timestamp(message.timestamp)),
        # Foxglove's levels are tenths of ROS 2's.
        level=10 * message.level,
        name=message.name,
        msg=message.message,
        file=message.file,
        line=message.line,
    )


def _wrench(side: Side, message: ArmStates) -> Any | None:
    """Force and torque as the arm's device reports them, about the grip and in its frame.

    A torque that the device does not report is not a number, as in ros2_control.
    """
    for arm in message.arms:
        if arm.arm == side and len(arm.force) == 3 and len(arm.orientation) == 4:
            to_grip = poses.conjugate(np.array(arm.orientation))
            force, torque = (
                vector(poses.rotate(to_grip, np.array(values)))
                for values in (arm.force, arm.torque or [np.nan] * 3)
            )
            return ros(
                "geometry_msgs/msg/WrenchStamped",
                header=header(message.stamp, frame_name(side, GRIP)),
                wrench=ros("geometry_msgs/msg/Wrench", force=force, torque=torque),
            )
    return None


def _clock(message: NodeChain | RawImage) -> Any:
    return ros("rosgraph_msgs/msg/Clock", clock=time(stamp_of(message)))


def _path(message: Path) -> Any | None:
    if not message.dt:
        return None
    grips = {
        "left": (message.left_positions, message.left_orientations),
        "right": (message.right_positions, message.right_orientations),
    }
    return _trajectory(grips, message.stamp, 0, message.dt)


def _setpoints(message: Setpoints) -> Any | None:
    if not message.arms:
        return None
    grips = {arm.arm: (arm.positions, arm.orientations) for arm in message.arms}
    return _trajectory(grips, message.stamp, message.t0 - message.stamp, message.dt)


def _trajectory(grips: dict[str, tuple[Any, Any]], stamp: int, first: int, dt: int) -> Any:
    """Trajectory of the grips, with times [ns]; `stamp` is what they count from."""
    arms = [
        np.hstack([np.reshape(positions, (-1, 3)), np.reshape(turns, (-1, 4))[:, XYZW]])
        for positions, turns in grips.values()
    ]
    count = min(map(len, arms))
    # A point begins with the number of its transforms, which `Rows` states for the first one.
    rows = np.zeros(count, [("transforms", "<f8", (len(arms), 7)), ("rates", "<u4", 2),
                            ("time", "<i4", 2), ("next", "<u4", 2)])  # fmt: skip
    rows["transforms"] = np.stack([arm[:count] for arm in arms], axis=1)
    times = [divmod(first + k * dt, SECOND) for k in range(count)]
    rows["time"] = np.array(times, "<i4").reshape(count, 2)
    rows["next"] = len(arms), 0
    return ros(
        "trajectory_msgs/msg/MultiDOFJointTrajectory",
        header=header(stamp, WORLD_FRAME),
        joint_names=[frame_name(side, GRIP) for side in grips],
        points=Rows((count, len(arms)), rows.view(np.uint8)[:-8]) if count else [],
    )
