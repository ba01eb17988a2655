"""Export to ROS 2: a rosbag2 that a reader of its own decodes."""

from __future__ import annotations

from collections import defaultdict
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader
from rosbags.rosbag2 import Reader

from cli.export import main
from lariat.arms.cr5_installation import scenario_joints
from lariat.geometry.poses import rotate
from lariat.trajectory import SECOND
from services.recorder.view.point_clouds import point_cloud
from shared import topics
from shared.ros2.outputs import outputs
from shared.ros2.types import STORE
from tests.cli.export.recorded import STEP, recording
from tests.services.recorder.view import cell


@pytest.fixture(scope="module", params=[True, False], ids=["drawn", "not drawn"])
def bag(request, tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("bag")
    assert main((recording(folder, drawn=request.param),), "ros2", folder / "bag") == 0
    return folder / "bag"


def read(bag: Path) -> dict[str, list]:
    """Decoded messages by topic."""
    found = defaultdict(list)
    with Reader(bag) as reader:
        for connection, _, content in reader.messages():
            message = STORE.deserialize_cdr(content, connection.msgtype)
            found[connection.topic].append(message)
    return found


def test_every_kind_of_message_has_its_counterpart(bag: Path):
    kinds = {topic: messages[0].__msgtype__ for topic, messages in read(bag).items()}
    assert kinds == {
        "/robot_description": "std_msgs/msg/String",
        "/tf": "tf2_msgs/msg/TFMessage",
        "/tf_static": "tf2_msgs/msg/TFMessage",
        "/joint_states": "sensor_msgs/msg/JointState",
        "/view/markers": "visualization_msgs/msg/MarkerArray",
        "/camera/overhead/depth/points": "sensor_msgs/msg/PointCloud2",
        "/camera/overhead/color/image_raw/compressed": "sensor_msgs/msg/CompressedImage",
        "/camera/overhead/depth/image_raw": "sensor_msgs/msg/Image",
        "/camera/overhead/color/camera_info": "sensor_msgs/msg/CameraInfo",
        "/camera/overhead/depth/camera_info": "sensor_msgs/msg/CameraInfo",
        "/rope/points": "sensor_msgs/msg/PointCloud2",
        "/rope/poses": "geometry_msgs/msg/PoseArray",
        "/goal/poses": "geometry_msgs/msg/PoseArray",
        "/controller/prediction": "geometry_msgs/msg/PoseArray",
        "/diagnostics": "diagnostic_msgs/msg/DiagnosticArray",
        "/rosout": "rcl_interfaces/msg/Log",
        "/controller/path": "trajectory_msgs/msg/MultiDOFJointTrajectory",
        "/arm/setpoints": "trajectory_msgs/msg/MultiDOFJointTrajectory",
        "/arm/left/wrench": "geometry_msgs/msg/WrenchStamped",
        "/arm/right/wrench": "geometry_msgs/msg/WrenchStamped",
    }


def test_values_times_and_colours_are_those_of_the_recording(bag: Path, tmp_path: Path):
    found = read(bag)
    joints = found["/joint_states"][0]
    assert joints.name[0] == "right/joint_1"
    expected = np.radians(scenario_joints(cell.scenario(tmp_path), "right"))
    np.testing.assert_allclose(joints.position, expected)
    assert joints.header.stamp.sec == cell.NOW // SECOND
    cloud = found["/camera/overhead/depth/points"][0]
    points = np.frombuffer(cloud.data.tobytes(), [("position", "<f4", 3), ("rgba", "<u4")])
    np.testing.assert_allclose(points["position"][0], [-0.39, -0.3, 1.0], atol=1e-6)
    depth = found["/camera/overhead/depth/image_raw"][-1]
    assert (depth.encoding, depth.width, depth.data[2:4].tolist()) == ("16UC1", 80, [0xE8, 0x03])
    log = found["/rosout"][0]
    assert (log.level, log.name, log.msg, log.line) == (30, "sim", "late", 7)
    setpoints = found["/arm/setpoints"][2]
    assert setpoints.joint_names == ["right/grip"]
    starts = [p.time_from_start.sec * SECOND + p.time_from_start.nanosec for p in setpoints.points]
    assert starts == [STEP, STEP + 20_000_000]
    assert setpoints.points[1].transforms[0].translation.z == 0.4


def test_a_point_has_its_colour_as_one_number():
    (row,) = [row for row in outputs() if row.source == topics.VIEW_POINTS]
    orange = np.array([[1.0, 0.6, 0.1, 1.0]])
    cloud = row.convert(point_cloud(np.zeros((1, 3)), orange, "overhead", 0))
    # 0xAARRGGBB, as RViz takes it.
    assert hex(cloud.data.view("<u4")[3]) == "0xffff991a"


def test_forces_are_in_the_frame_of_the_grip_and_no_torque_is_made_up(bag: Path):
    found = read(bag)
    grips = {t.child_frame_id: t for m in found["/tf"] for t in m.transforms}
    for side in ("left", "right"):
        message = found[f"/arm/{side}/wrench"][0]
        force, torque = message.wrench.force, message.wrench.torque
        assert message.header.frame_id == f"{side}/grip"
        q = grips[f"{side}/grip"].transform.rotation
        in_world = rotate(np.array([q.w, q.x, q.y, q.z]), np.array([force.x, force.y, force.z]))
        np.testing.assert_allclose(in_world, [1.0, 2.0, 3.0], atol=1e-12)
        length = np.linalg.norm([torque.x, torque.y, torque.z])
        assert length == pytest.approx(np.nan if side == "left" else 0.14**0.5, nan_ok=True)


def test_markers_move_with_the_frames_of_the_arms(bag: Path):
    found = read(bag)
    markers = [m for array in found["/view/markers"] for m in array.markers]
    link = next(m for m in markers if m.ns == "right/link_3")
    assert (link.header.frame_id, link.frame_locked, link.type) == ("right/link_3", True, 3)
    frames = {t.child_frame_id for m in found["/tf"] for t in m.transforms}
    static = {t.child_frame_id for m in found["/tf_static"] for t in m.transforms}
    assert static == {"overhead", "right/base_link"}
    assert frames == {"left/grip", "right/grip", *(f"right/link_{k}" for k in range(1, 7))}
    rope = next(m for m in markers if m.ns == "rope")
    assert (len(rope.points), len(rope.colors)) == (4, 4)


def test_the_bag_is_an_mcap_file_of_the_profile_ros2(bag: Path):
    (file,) = bag.glob("*.mcap")
    with file.open("rb") as stream:
        reader = make_reader(stream)
        assert reader.get_header().profile == "ros2"
        summary = reader.get_summary()
    assert summary is not None
    encodings = {schema.encoding for schema in summary.schemas.values()}
    assert encodings == {"ros2msg"}
