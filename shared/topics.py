"""Table of all topics: key, message type, owner, and buffering in an inbox.

Keys are relative to the cell's namespace. The bus keeps no messages for late subscribers: the owner
of a state publishes it on every change and at least once a second. A request to change a state
carries an id; the owner repeats the id in its state when it has handled the request.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Literal

from foxglove_schemas_protobuf.CameraCalibration_pb2 import CameraCalibration
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.JointStates_pb2 import JointStates
from foxglove_schemas_protobuf.Log_pb2 import Log
from foxglove_schemas_protobuf.PointCloud_pb2 import PointCloud
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate

from shared.messages import (
    ArmCommand,
    ArmStates,
    CampaignState,
    Consent,
    GoalDraft,
    GoalList,
    GoalListRequest,
    GoalPreview,
    Health,
    JointTrajectory,
    Message,
    NodeChain,
    OtherRopes,
    Parameters,
    Path,
    Plan,
    RecordState,
    RunCurves,
    RunList,
    RunListRequest,
    RunMotion,
    RunPicture,
    RunResult,
    RunVideo,
    Scene,
    SceneMotion,
    SceneRequest,
    Setpoints,
    StackRequest,
    StackState,
    TaskRequest,
    TaskState,
    Trace,
)

MAX_IMAGE_SIZE = 2**25 + 2**16
"""Largest message of a topic that carries images [bytes]: a depth image of the most pixels in
millimetres, with its header."""
MAX_STATE_SIZE = 4 * 2**20
"""Largest message of a state [bytes]; the path of 2 m of rope has 0.5 MB."""
MAX_EVENT_SIZE = 256 * 1024
"""Largest message of a topic of which every message counts [bytes]: many of them wait unread."""

Buffering = Literal["latest", "every", "joined"]
"""Rule by which an inbox keeps the messages of a topic between two steps."""


@dataclass(frozen=True)
class Topic:
    """Topic of the bus, with the tolerances that replay allows its messages."""

    key: str
    """Key on the bus, e.g. `rope/nodes`; may contain one {placeholder}, which `at` fills."""
    type: type[Message]
    """Type of its messages."""
    owner: str
    """Processes that publish it."""
    buffering: Buffering
    """`latest`: a state, only the newest message counts. `every`: requests, no message may be
    missed. `joined`: messages of several topics with the same stamp are taken together."""
    urgent: bool = False
    """Whether it is sent before all other topics and without batching."""
    large: bool = False
    """Whether it carries images, which are sent after all other topics."""
    recorded: bool = True
    """Whether recordings hold it; what concerns other runs does not belong to a run's file."""
    tolerance: dict[str, float] = field(default_factory=dict, hash=False)
    """Largest absolute difference in a replay, by field; fields that are not named must be
    equal."""
    relative_tolerance: dict[str, float] = field(default_factory=dict, hash=False)
    """Largest difference in a replay as a fraction of the larger value, by field; it is allowed in
    addition to `tolerance`."""
    median_tolerance: dict[str, float] = field(default_factory=dict, hash=False)
    """Largest median, over the messages of a recording, of a field's largest difference."""
    pixel_tolerance: float = 0.0
    """Largest fraction of the pixels of an image that may differ in a replay [-]."""

    @property
    def max_size(self) -> int:
        """Largest message that a process takes from the bus [bytes]."""
        if self.large:
            return MAX_IMAGE_SIZE
        return MAX_EVENT_SIZE if self.buffering == "every" else MAX_STATE_SIZE

    def at(self, name: str) -> Topic:
        """Return the topic with its placeholder filled.

        Raises:
            ValueError: The key has no placeholder.
        """
        start, end = self.key.index("{"), self.key.index("}")
        return replace(self, key=self.key[:start] + name + self.key[end + 1 :])

    def matches(self, key: str) -> bool:
        """Return whether a concrete key is this topic's, with any value of the placeholder."""
        mine, other = self.key.split("/"), key.split("/")
        return len(mine) == len(other) and all(
            a == b or a.startswith("{") for a, b in zip(mine, other, strict=True)
        )


# Replay tolerances hold on other machines as well, whose compilers order sums differently, so that
# last bits differ. The effect of a change in the last bit is measured (docs/guide/testing.md); each
# tolerance lies above it.
#
# A rendered depth close to a rounding threshold rounds the other way in about one pixel of 10 000.
CAMERA_COLOR = Topic(
    "camera/{name}/color",
    CompressedImage,
    "sim, camera",
    "joined",
    large=True,
    pixel_tolerance=5e-4,
)
CAMERA_DEPTH = Topic(
    "camera/{name}/depth", RawImage, "sim, camera", "joined", large=True, pixel_tolerance=5e-4
)
CAMERA_CALIBRATION = Topic("camera/{name}/calibration", CameraCalibration, "sim, camera", "latest")
# The fit stops when no node moves further than 1e-5 m. The last bit can decide on one more or one
# less iteration, which moves single chains by up to 5e-5 m and the median chain by 2e-8 m.
ROPE_NODES = Topic(
    "rope/nodes",
    NodeChain,
    "perception",
    "latest",
    tolerance={"positions": 2e-4, "sigma": 2e-5, "p_wrong": 1e-3},
    median_tolerance={"positions": 5e-8},
)
ROPE_TRUTH = Topic("rope/truth", NodeChain, "sim", "latest", tolerance={"positions": 1e-8})
ROPE_OTHERS = Topic("rope/others", OtherRopes, "perception", "latest", tolerance={"ropes": 2e-4})
SCENE_STATE = Topic("scene/state", Scene, "perception", "latest", tolerance={"obstacles": 1e-9})
SCENE_MOTION = Topic("scene/motion", SceneMotion, "perception", "latest")
SCENE_REQUEST = Topic("scene/request", SceneRequest, "dashboard, lariat, ros2", "every")
TASK_STATE = Topic(
    "task/state",
    TaskState,
    "controller",
    "latest",
    tolerance={"goal": 1e-6, "error": 1e-6, "clearance": 1e-6},
)
TASK_REQUEST = Topic("task/request", TaskRequest, "dashboard, lariat, ros2", "every")
TASK_GOAL_DRAFT = Topic("task/goal_draft", GoalDraft, "dashboard", "latest")
TASK_GOAL_PREVIEW = Topic(
    "task/goal_preview", GoalPreview, "controller", "latest", tolerance={"goal": 1e-6}
)
# Optimisers amplify differences in the last bit to 5e-13 m in their paths and horizons.
CONTROLLER_PATH = Topic(
    "controller/path",
    Path,
    "planner",
    "latest",
    tolerance=dict.fromkeys(
        (
            "left_positions",
            "left_orientations",
            "right_positions",
            "right_orientations",
            "nodes",
            "final_error",
            "clearance",
            "certain_clearance",
        ),
        1e-7,
    ),
)
CONTROLLER_PLAN = Topic(
    "controller/plan", Plan, "controller", "latest", tolerance={"nodes": 1e-7, "cost": 1e-5}
)
CONTROLLER_PARAMETERS = Topic(
    "controller/parameters",
    Parameters,
    "controller",
    "latest",
    tolerance={"parameters": 1e-12, "rod": 1e-12, "xpbd": 1e-12, "prediction_error": 1e-7}
    | {"unknowns": 1e-9, "covariance": 1e-9},
    relative_tolerance=dict.fromkeys(("parameters", "rod", "xpbd", "covariance"), 1e-6),
)
ARM_SETPOINTS = Topic(
    "arm/setpoints", Setpoints, "controller", "every", urgent=True, tolerance={"arms": 1e-7}
)
# Results of linear algebra differ between machines in the last bits.
ARM_STATE = Topic(
    "arm/state", ArmStates, "robot_gateway", "every", urgent=True, tolerance={"arms": 1e-7}
)
ARM_COMMAND = Topic("arm/command", ArmCommand, "dashboard, lariat", "every", urgent=True)
# Every message of it is a hold, whatever its action: a right to stop that cannot move anything.
ARM_HOLD = Topic("arm/hold", ArmCommand, "ros2", "every", urgent=True)
ARM_TRAJECTORY = Topic("arm/trajectory", JointTrajectory, "ros2", "every", urgent=True)
ARM_CONSENT = Topic("arm/consent", Consent, "dashboard, lariat", "every", urgent=True)
RUN_RESULT = Topic(
    "run/result",
    RunResult,
    "controller",
    "latest",
    tolerance={"error": 1e-6, "max_node_error": 1e-6, "min_clearance": 1e-6, "duration": 1e-6},
)
# The head of a file names version and commit, compression depends on the library's version, and the
# rest waits for a flush.
RUN_RECORD = Topic(
    "run/record",
    RecordState,
    "recorder",
    "latest",
    tolerance={"bytes": 131072, "recordings_size": math.inf, "free_space": math.inf},
)
RUN_LIST = Topic("run/list", RunList, "recorder", "latest", recorded=False)
RUN_LIST_REQUEST = Topic("run/list_request", RunListRequest, "dashboard", "every")
RUN_CURVES = Topic("run/curves", RunCurves, "recorder", "every", recorded=False)
RUN_MOTION = Topic("run/motion", RunMotion, "recorder", "latest", recorded=False)
RUN_PICTURE = Topic("run/picture", RunPicture, "recorder", "latest", large=True, recorded=False)
RUN_VIDEO = Topic("run/video", RunVideo, "recorder", "latest", large=True, recorded=False)
GOAL_LIST = Topic("goal/list", GoalList, "recorder", "latest", recorded=False)
GOAL_LIST_REQUEST = Topic("goal/list_request", GoalListRequest, "dashboard", "every")
HEALTH = Topic("health/{service}", Health, "every service", "latest")
TRACE = Topic("trace/{service}", Trace, "every service", "latest")
LOG = Topic("log/{service}", Log, "every service", "every")
STACK_STATE = Topic("stack/state", StackState, "lariat", "latest")
STACK_REQUEST = Topic("stack/request", StackRequest, "dashboard, lariat", "every")
CAMPAIGN_STATE = Topic("campaign/state", CampaignState, "lariat", "latest")
VIEW_SCENE = Topic("view/scene", SceneUpdate, "recorder", "latest")
VIEW_POINTS = Topic("view/points/{name}", PointCloud, "recorder", "latest")
VIEW_TRANSFORMS = Topic("view/transforms", FrameTransforms, "recorder", "latest")
VIEW_JOINTS = Topic("view/joints", JointStates, "recorder", "latest")

TOPICS: tuple[Topic, ...] = tuple(v for v in list(globals().values()) if isinstance(v, Topic))
"""All topics, in the order of the table."""


# Asked for each message of a recording; strangers may name any number of keys.
@lru_cache(maxsize=1024)
def find(key: str) -> Topic:
    """Return the topic of a concrete key, with that key.

    Raises:
        KeyError: No topic has this key.
    """
    for topic in TOPICS:
        if topic.matches(key):
            return replace(topic, key=key)
    raise KeyError(f"no topic {key!r}; shared/topics.py lists them")
