"""Messages of a small cell with a CR5 and a camera, for what is drawn of them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from foxglove_schemas_protobuf.CameraCalibration_pb2 import CameraCalibration
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage

from lariat.arms.cr5_installation import scenario_joints
from lariat.geometry.poses import Pose
from lariat.scenario import SIDES, Scenario, parse
from lariat.scenario.cameras import DEFAULT_CAMERA
from lariat.trajectory import SECOND
from services.recorder.view.cell_view import CellView
from shared import topics
from shared.messages import (
    ArmState,
    ArmStates,
    Goal,
    Message,
    NodeChain,
    Plan,
    Scene,
    TaskState,
    obstacle_message,
    timestamp,
)
from shared.messages import Path as PathMessage
from shared.topics import Topic

TEXT = """
name = "drawn"
[rope]
length = 0.45
diameter = 0.008
node_count = 5
[ends.left]
driver = "fixed"
[ends.right]
driver = "cr5"
rotates = true
base_position = [0.6, 0.0, 0.0]
tool_orientation = [0.0, 1.0, 0.0, 0.0]
[start]
line = [[-0.2, 0.0, 0.3], [0.2, 0.0, 0.3]]
[goal]
line = [[-0.2, 0.0, 0.3], [0.2, 0.1, 0.3]]
[[obstacles]]
shape = "capsule"
position = [0.0, 0.0, 0.2]
radius = 0.02
height = 0.1
[sensing]
source = "camera"
position = [0.0, 0.0, 1.0]
look_at = [0.0, 0.0, 0.0]
"""
NOW = 1_800_000_000 * SECOND
WIDTH, HEIGHT, FOCAL = 80, 60, 100.0


def scenario(folder: Path) -> Scenario:
    return parse(TEXT, folder)


def messages(cell: Scenario, now: int = NOW) -> list[tuple[Topic, Message]]:
    """One message of each drawn topic."""
    line = np.linspace([-0.2, 0.0, 0.3], [0.2, 0.0, 0.3], 4)
    grips = dict(zip(SIDES, cell.grips(cell.start), strict=True))
    joints = {"left": [], "right": np.radians(scenario_joints(cell, "right"))}
    arms = [
        ArmState(
            arm=side,
            position=grips[side].position,
            orientation=grips[side].orientation,
            joints=joints[side],
            # The left arm reports no torque.
            force=[1.0, 2.0, 3.0],
            torque=[0.1, 0.2, 0.3] if side == "right" else [],
        )
        for side in SIDES
    ]
    # A table one metre below a camera that looks down.
    depth = np.full((HEIGHT, WIDTH), 1000, "<u2")
    depth[0, 0] = 0
    K = [FOCAL, 0.0, WIDTH / 2, 0.0, FOCAL, HEIGHT / 2, 0.0, 0.0, 1.0]
    camera = DEFAULT_CAMERA
    return [
        (topics.ROPE_NODES, NodeChain(stamp=now, positions=line.ravel(), sigma=[0, 1e-3, 2e-3, 9])),
        (topics.ROPE_TRUTH, NodeChain(stamp=now, positions=line.ravel())),
        (topics.TASK_STATE, TaskState(stamp=now, goal=Goal(positions=(line + 0.1).ravel()))),
        (
            topics.CONTROLLER_PLAN,
            Plan(stamp=now, node_count=4, nodes=np.concatenate([line, line + 0.05]).ravel()),
        ),
        (
            topics.CONTROLLER_PATH,
            PathMessage(
                stamp=now,
                dt=20_000_000,
                left_orientations=[1.0, 0.0, 0.0, 0.0] * 3,
                right_orientations=[1.0, 0.0, 0.0, 0.0] * 3,
                left_positions=np.tile(line[0], 3),
                right_positions=np.tile(line[-1], 3),
                nodes=np.tile(line.ravel(), 3),
                node_count=4,
            ),
        ),
        (
            topics.SCENE_STATE,
            Scene(stamp=now, obstacles=[obstacle_message(b) for b in cell.bodies]),
        ),
        (topics.ARM_STATE, ArmStates(stamp=now, arms=arms)),
        (
            topics.CAMERA_CALIBRATION.at(camera),
            CameraCalibration(
                timestamp=timestamp(now), frame_id=camera, width=WIDTH, height=HEIGHT, K=K
            ),
        ),
        (
            topics.CAMERA_DEPTH.at(camera),
            RawImage(
                timestamp=timestamp(now),
                frame_id=camera,
                width=WIDTH,
                height=HEIGHT,
                encoding="16UC1",
                step=2 * WIDTH,
                data=depth.tobytes(),
            ),
        ),
    ]


def view(cell: Scenario) -> CellView:
    """View that has taken one message of each topic."""
    drawn = CellView(cell)
    for topic, message in messages(cell):
        drawn.take(topic.key, message.SerializeToString())
    return drawn


def pose(transforms, child: str) -> Pose:
    """Pose of a frame in its parent."""
    (found,) = [t for t in transforms if t.child_frame_id == child]
    p, q = found.translation, found.rotation
    return Pose(np.array([p.x, p.y, p.z]), np.array([q.w, q.x, q.y, q.z]))
