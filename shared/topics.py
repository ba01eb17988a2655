"""THE table: every topic, its message, its owner, and how an inbox holds it.

Keys are relative to the cell's namespace. Nothing is latched: the owner of a state publishes it on
change and at least once a second; whoever wants it changed sends a request with an id, and the
owner answers in its state.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Literal

from foxglove_schemas_protobuf.CameraCalibration_pb2 import CameraCalibration
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from foxglove_schemas_protobuf.Log_pb2 import Log
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate

from shared.messages import (
    ArmCommand,
    ArmStates,
    GoalDraft,
    GoalPreview,
    Health,
    Message,
    NodeChain,
    Parameters,
    Path,
    Plan,
    RecordState,
    RunResult,
    Scene,
    SceneRequest,
    Setpoints,
    StackState,
    TaskRequest,
    TaskState,
    Trace,
)

Hold = Literal["latest", "every", "joined"]


@dataclass(frozen=True)
class Topic:
    """One row of the table."""

    key: str
    """May hold one {placeholder}, filled by `at`."""
    type: type[Message]
    owner: str
    hold: Hold
    """`latest`: states, only the newest counts. `every`: none may be missed. `joined`: several
    topics of one stamp are taken together."""
    urgent: bool = False
    """Sent before everything else and without batching."""
    large: bool = False
    """Images: a late one is dropped rather than waited for."""
    tolerance: dict[str, float] = field(default_factory=dict, hash=False)
    """Replay: allowed absolute difference by field; fields that are not named must be equal."""

    def at(self, name: str) -> Topic:
        """The topic with its placeholder filled."""
        start, end = self.key.index("{"), self.key.index("}")
        return replace(self, key=self.key[:start] + name + self.key[end + 1 :])

    def matches(self, key: str) -> bool:
        """Whether a concrete key belongs to this row."""
        mine, other = self.key.split("/"), key.split("/")
        return len(mine) == len(other) and all(
            a == b or a.startswith("{") for a, b in zip(mine, other, strict=True)
        )


CAMERA_COLOR = Topic("camera/{name}/color", CompressedImage, "sim", "joined", large=True)
CAMERA_DEPTH = Topic("camera/{name}/depth", RawImage, "sim", "joined", large=True)
CAMERA_CALIBRATION = Topic("camera/{name}/calibration", CameraCalibration, "sim", "latest")
# Positions 1e-6 m: images decode alike everywhere, but sums may differ in their last bits.
ROPE_NODES = Topic(
    "rope/nodes", NodeChain, "perception", "latest", tolerance={"positions": 1e-6, "sigma": 1e-6}
)
ROPE_TRUTH = Topic("rope/truth", NodeChain, "sim", "latest", tolerance={"positions": 1e-6})
SCENE_STATE = Topic("scene/state", Scene, "perception", "latest")
SCENE_REQUEST = Topic("scene/request", SceneRequest, "dashboard, lariat", "every")
TASK_STATE = Topic(
    "task/state",
    TaskState,
    "controller",
    "latest",
    tolerance={"goal": 1e-6, "error": 1e-5, "clearance": 1e-5},
)
TASK_REQUEST = Topic("task/request", TaskRequest, "dashboard, lariat", "every")
TASK_GOAL_DRAFT = Topic("task/goal_draft", GoalDraft, "dashboard", "latest")
TASK_GOAL_PREVIEW = Topic(
    "task/goal_preview", GoalPreview, "controller", "latest", tolerance={"goal": 1e-6}
)
# Optimisers amplify last bits: 1e-5 m on what they predict and command.
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
        ),
        1e-5,
    ),
)
CONTROLLER_PLAN = Topic(
    "controller/plan", Plan, "controller", "latest", tolerance={"nodes": 1e-5, "cost": 1e-3}
)
CONTROLLER_PARAMETERS = Topic(
    "controller/parameters",
    Parameters,
    "controller",
    "latest",
    tolerance={"parameters": 1e-3, "prediction_error": 1e-5},
)
ARM_SETPOINTS = Topic(
    "arm/setpoints", Setpoints, "controller", "every", urgent=True, tolerance={"arms": 1e-5}
)
# Linear algebra differs between machines in its last bits.
ARM_STATE = Topic(
    "arm/state", ArmStates, "robot_gateway", "every", urgent=True, tolerance={"arms": 1e-6}
)
ARM_COMMAND = Topic("arm/command", ArmCommand, "dashboard, lariat", "every", urgent=True)
RUN_RESULT = Topic(
    "run/result",
    RunResult,
    "controller",
    "latest",
    tolerance={"error": 1e-5, "max_node_error": 1e-5, "min_clearance": 1e-5, "duration": 1e-6},
)
# A file's head names version and commit, and compression differs between library versions.
RUN_RECORD = Topic("run/record", RecordState, "recorder", "latest", tolerance={"bytes": 16384})
HEALTH = Topic("health/{service}", Health, "every service", "latest")
TRACE = Topic("trace/{service}", Trace, "every service", "latest")
LOG = Topic("log/{service}", Log, "every service", "every")
STACK_STATE = Topic("stack/state", StackState, "lariat", "latest")
VIEW_SCENE = Topic("view/scene", SceneUpdate, "recorder", "latest")

TOPICS: tuple[Topic, ...] = tuple(v for v in list(globals().values()) if isinstance(v, Topic))

CAMERA = "overhead"
"""Name of the camera that the simulated lab has."""


def find(key: str) -> Topic:
    """The row of a concrete key.

    Raises:
        KeyError: No row matches.
    """
    for topic in TOPICS:
        if topic.matches(key):
            return replace(topic, key=key)
    raise KeyError(f"no topic {key!r}; shared/topics.py lists them")
