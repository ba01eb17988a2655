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
    """Replay: allowed absolute difference of every value, by field; fields that are not named must
    be equal."""
    relative_tolerance: dict[str, float] = field(default_factory=dict, hash=False)
    """Replay: allowed difference by field as a fraction of the larger value, beside `tolerance`."""
    median_tolerance: dict[str, float] = field(default_factory=dict, hash=False)
    """Replay: allowed median, over the messages of a recording, of a field's largest difference."""
    pixel_tolerance: float = 0.0
    """Replay: allowed fraction of pixels that differ in an image [-]."""

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


# Replay tolerances shall hold on other machines, whose compilers order sums differently: last bits
# differ there. The effect of a change in the last bit is measured (docs/testing.md), and each
# tolerance lies above it.
#
# A rendered depth next to a rounding step falls to its other side, in about one pixel of 10 000.
CAMERA_COLOR = Topic(
    "camera/{name}/color", CompressedImage, "sim", "joined", large=True, pixel_tolerance=5e-4
)
CAMERA_DEPTH = Topic(
    "camera/{name}/depth", RawImage, "sim", "joined", large=True, pixel_tolerance=5e-4
)
CAMERA_CALIBRATION = Topic("camera/{name}/calibration", CameraCalibration, "sim", "latest")
# The fit stops when no node moves further than 1e-5 m: one iteration more or less, which a last bit
# decides, moves single chains by up to 5e-5 m and the median chain by 2e-8 m.
ROPE_NODES = Topic(
    "rope/nodes",
    NodeChain,
    "perception",
    "latest",
    tolerance={"positions": 2e-4, "sigma": 2e-5},
    median_tolerance={"positions": 5e-8},
)
ROPE_TRUTH = Topic("rope/truth", NodeChain, "sim", "latest", tolerance={"positions": 1e-8})
SCENE_STATE = Topic("scene/state", Scene, "perception", "latest")
SCENE_REQUEST = Topic("scene/request", SceneRequest, "dashboard, lariat", "every")
TASK_STATE = Topic(
    "task/state",
    TaskState,
    "controller",
    "latest",
    tolerance={"goal": 1e-6, "error": 1e-6, "clearance": 1e-6},
)
TASK_REQUEST = Topic("task/request", TaskRequest, "dashboard, lariat", "every")
TASK_GOAL_DRAFT = Topic("task/goal_draft", GoalDraft, "dashboard", "latest")
TASK_GOAL_PREVIEW = Topic(
    "task/goal_preview", GoalPreview, "controller", "latest", tolerance={"goal": 1e-6}
)
# Optimisers amplify last bits, to 5e-13 m in their paths and horizons.
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
    tolerance={"parameters": 1e-12, "prediction_error": 1e-7},
    relative_tolerance={"parameters": 1e-6},
)
ARM_SETPOINTS = Topic(
    "arm/setpoints", Setpoints, "controller", "every", urgent=True, tolerance={"arms": 1e-7}
)
# Linear algebra differs between machines in its last bits.
ARM_STATE = Topic(
    "arm/state", ArmStates, "robot_gateway", "every", urgent=True, tolerance={"arms": 1e-7}
)
ARM_COMMAND = Topic("arm/command", ArmCommand, "dashboard, lariat", "every", urgent=True)
RUN_RESULT = Topic(
    "run/result",
    RunResult,
    "controller",
    "latest",
    tolerance={"error": 1e-6, "max_node_error": 1e-6, "min_clearance": 1e-6, "duration": 1e-6},
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
