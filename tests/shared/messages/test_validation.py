"""Validation: every recorded message passes, garbage is refused by name, nothing else is raised."""

from __future__ import annotations

import math
import random
from pathlib import Path as FilePath

import pytest
from foxglove_schemas_protobuf.CameraCalibration_pb2 import CameraCalibration
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage
from google.protobuf.message import Message
from google.protobuf.timestamp_pb2 import Timestamp

from shared import topics
from shared.messages import (
    ArmCommand,
    ArmSetpoints,
    ArmState,
    ArmStates,
    CampaignState,
    CampaignTrial,
    Estimate,
    Goal,
    GoalDraft,
    Grip,
    NodeChain,
    Obstacle,
    ObstacleMotion,
    OtherRope,
    OtherRopes,
    Parameters,
    Path,
    Plan,
    RodParameters,
    RopeLine,
    RunCurves,
    RunMotion,
    Scene,
    SceneMotion,
    Setpoints,
    TaskRequest,
    TaskState,
)
from shared.messages.validation import decode
from shared.recording import Recording
from shared.topics import Topic
from tests.lariat.files.test_image_header import png_header

LINE = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 2.0, 0.0, 0.0]
ZERO_TURN = Grip(position=[0.0] * 3, orientation=[0.0] * 4)
FAR_AWAY = Grip(position=[0.0, 1e5, 0.0], orientation=[1.0, 0.0, 0.0, 0.0])


def beside(
    positions: tuple[float, ...] | list[float] = (0.0,) * 6,
    diameter: float = 0.01,
    p_wrong: float = 0.0,
) -> OtherRopes:
    line = RopeLine(positions=positions)
    return OtherRopes(ropes=[OtherRope(lines=[line], diameter=diameter, p_wrong=p_wrong)])


REFERENCES = sorted((FilePath(__file__).parents[2] / "replay").glob("*.mcap"))


def moving(**changes) -> SceneMotion:
    """Motion of one obstacle by 0.3 m in a second, with some fields changed."""
    fields = {
        "position": [0.0] * 3,
        "velocity": [0.3, 0.0, 0.0],
        "times": [0, 10**9],
        "waypoints": [0.0, 0.0, 0.0, 0.3, 0.0, 0.0],
    }
    return SceneMotion(motions=[ObstacleMotion(name="cart", **(fields | changes))])


@pytest.mark.parametrize("recording", REFERENCES, ids=lambda path: path.stem)
def test_every_message_of_a_run_is_valid(recording: FilePath) -> None:
    count = 0
    for entry in Recording.open(recording).messages():
        decode(entry.topic, entry.parse().SerializeToString())
        count += 1
    assert count > 40


@pytest.mark.parametrize(
    ("topic", "message", "refusal"),
    [
        (topics.ROPE_NODES, NodeChain(positions=[0.0, 1.0]), "not 3 a point"),
        (topics.ROPE_NODES, NodeChain(positions=[0.0] * 3), "a rope has 2 to"),
        (topics.ROPE_NODES, NodeChain(positions=[0.0] * 6, p_wrong=-0.1), "is no probability"),
        (topics.ROPE_NODES, NodeChain(p_wrong=math.nan), "is no probability"),
        (topics.ROPE_OTHERS, beside(positions=[0.0] * 3), "positions has 1 nodes"),
        (topics.ROPE_OTHERS, beside(positions=[0.0] * 5 + [1e4]), "beyond ±100 m"),
        (topics.ROPE_OTHERS, beside(diameter=0.0), "diameter = 0 m"),
        (topics.ROPE_OTHERS, beside(p_wrong=1.5), "p_wrong = 1.5 is no probability"),
        (topics.ROPE_OTHERS, OtherRopes(ropes=33 * [OtherRope()]), "33 other ropes"),
        (topics.ROPE_NODES, NodeChain(positions=[0.0] * 5 + [math.nan]), "or none"),
        (topics.ROPE_NODES, NodeChain(positions=[0.0] * 119 + [math.nan]), "or none"),
        (topics.ROPE_NODES, NodeChain(positions=[math.nan] + [0.0] * 119), "or none"),
        (topics.ROPE_NODES, NodeChain(positions=[0.0] * 119 + [-101.0]), "beyond ±100 m"),
        (topics.CONTROLLER_PLAN, Plan(nodes=[0.0] * 119 + [math.inf], node_count=40), "or none"),
        (topics.ROPE_NODES, NodeChain(positions=[0.0] * 6, observed=[True]), "observed has 1"),
        (topics.ROPE_NODES, NodeChain(stamp=2**63 - 1), "beyond"),
        (topics.ARM_COMMAND, ArmCommand(id="x" * 5000), "longer than 4096"),
        (topics.ARM_COMMAND, ArmCommand(), "names no action"),
        (
            topics.ARM_COMMAND,
            ArmCommand(action=ArmCommand.APPROACH, approach_distance=math.nan),
            "no distance",
        ),
        (topics.ARM_SETPOINTS, Setpoints(arms=[ArmSetpoints(arm="left")] * 2), "once"),
        (
            topics.ARM_SETPOINTS,
            Setpoints(arms=[ArmSetpoints(arm="left", positions=[0.0] * 3)]),
            "orientations has 0",
        ),
        (topics.ARM_STATE, ArmStates(arms=[ArmState(arm="left")]), "two ends"),
        (
            topics.ARM_STATE,
            ArmStates(arms=[ArmState(arm="left", position=[0.0]), ArmState(arm="right")]),
            "of 'left' have",
        ),
        (topics.TASK_REQUEST, TaskRequest(goal=Goal(positions=[0.0] * 4)), "not 3 a point"),
        (topics.TASK_REQUEST, TaskRequest(goal=Goal(turns=math.inf)), "turns"),
        (topics.TASK_REQUEST, TaskRequest(goal=Goal(part=[0.1])), "goal.part has 1 values"),
        (
            topics.TASK_REQUEST,
            TaskRequest(goal=Goal(part=[0.1, 0.2], ends_only=True)),
            "goal.part and goal.ends_only exclude each other",
        ),
        (
            topics.TASK_REQUEST,
            TaskRequest(goal=Goal(route=["clip"], ends_only=True)),
            "without part and ends_only",
        ),
        (topics.TASK_REQUEST, TaskRequest(goal=Goal(route=["clip"] * 101)), "101 entries"),
        (
            topics.TASK_REQUEST,
            TaskRequest(goal=Goal(part=[0.0, 1.0])),
            "holds 1 of the goal's nodes",
        ),
        (
            topics.TASK_REQUEST,
            TaskRequest(goal=Goal(positions=LINE, part=[3.0, 9.0])),
            "holds 0 of",
        ),
        (
            topics.TASK_REQUEST,
            TaskRequest(goal=Goal(positions=LINE, part=[2.0, 0.0])),
            "holds 0 of",
        ),
        (topics.TASK_STATE, TaskState(goal=Goal(positions=[0.0] * 6)), "position has 0"),
        (topics.TASK_STATE, TaskState(pace=1e-300), "pace = 1e-300 is not within"),
        (topics.TASK_STATE, TaskState(clearance_margin=math.nan), "clearance_margin = nan"),
        (topics.TASK_GOAL_DRAFT, GoalDraft(left=Grip(position=[0.0] * 3)), "orientation has 0"),
        (
            topics.CONTROLLER_PATH,
            Path(left_positions=[0.0] * 3, right_positions=[0.0] * 6),
            "right_positions has 6",
        ),
        (topics.CONTROLLER_PLAN, Plan(node_count=2, nodes=[0.0] * 7), "no chains"),
        (topics.SCENE_STATE, Scene(obstacles=[Obstacle(name="o", shape="torus")]), "use one of"),
        (topics.SCENE_STATE, Scene(obstacles=[Obstacle()] * 300), "300 obstacles"),
        (
            topics.SCENE_STATE,
            Scene(obstacles=[Obstacle(name="o", shape="sphere", position=[9.0] * 3, radius=-1.0)]),
            "takes 0 < radius",
        ),
        (topics.SCENE_MOTION, moving(times=[0]), "waypoints has 6 values; it takes 3"),
        (topics.SCENE_MOTION, moving(times=[0, 10**8]), "faster than 1 m/s"),
        (topics.SCENE_MOTION, moving(waypoints=[0.0] * 5 + [1e4]), "beyond ±100 m"),
        (topics.SCENE_MOTION, moving(position=[0.0]), "position has 1 values"),
        (topics.TASK_REQUEST, TaskRequest(goal=Goal(left=ZERO_TURN)), "has norm 0"),
        (topics.TASK_REQUEST, TaskRequest(goal=Goal(left=FAR_AWAY)), "beyond ±100 m"),
        (topics.TASK_REQUEST, TaskRequest(goal=Goal(positions=[0.0] * 5 + [1e5])), "±100 m"),
        (topics.TASK_GOAL_DRAFT, GoalDraft(left=ZERO_TURN, right=ZERO_TURN), "has norm 0"),
        (
            topics.CONTROLLER_PARAMETERS,
            Parameters(rod=RodParameters(bending_stiffness=Estimate(value=0.0))),
            "bending_stiffness = 0 is not",
        ),
        (
            topics.CONTROLLER_PARAMETERS,
            Parameters(rod=RodParameters(stiffness_profile=[Estimate(value=1.0)] * 300)),
            "300 values",
        ),
        (
            topics.CONTROLLER_PARAMETERS,
            Parameters(rod=RodParameters(grip_offset=[Estimate(value=0.0)] * 5)),
            "rod.grip_offset",
        ),
        (
            topics.CONTROLLER_PARAMETERS,
            Parameters(unknowns=[0.0] * 3, covariance=[0.0] * 9),
            "covariance has 9 values; it takes 6",
        ),
        (
            topics.CONTROLLER_PARAMETERS,
            Parameters(rod=RodParameters(length=Estimate(value=math.nan))),
            "length = nan",
        ),
        (topics.RUN_CURVES, RunCurves(time=[0.0, 0.1], error=[0.0]), "error has 1 values"),
        (topics.RUN_CURVES, RunCurves(time=[0.0], error=[0.0]), "clearance has 0 values"),
        (topics.RUN_MOTION, RunMotion(node_count=1, time=[0.0], nodes=[0.0] * 3), "node_count = 1"),
        (topics.RUN_MOTION, RunMotion(node_count=5, time=[0.0], nodes=[0.0] * 3), "takes 15"),
        (topics.RUN_MOTION, RunMotion(goal=[0.0] * 2), "goal has 2 values"),
        (
            topics.CAMPAIGN_STATE,
            CampaignState(keys=["seed"], trials=[CampaignTrial(seed=4)]),
            "values of seed 4 has 0 values; it takes 1",
        ),
        (
            topics.CAMERA_COLOR,
            CompressedImage(timestamp=Timestamp(seconds=2**61)),
            "timestamp holds an integer beyond",
        ),
        (topics.CAMERA_COLOR, CompressedImage(data=png_header(30000, 30000)), "30000 x 30000"),
        (topics.CAMERA_COLOR, CompressedImage(data=b"GIF"), "neither a PNG nor a JPEG"),
        (topics.CAMERA_DEPTH, RawImage(width=2**31, height=2**31), "pixels; an image has"),
        (topics.CAMERA_CALIBRATION, CameraCalibration(width=4, height=4, K=[1.0]), "K has 1"),
        (topics.CAMERA_CALIBRATION, CameraCalibration(width=4, height=4, K=[0.0] * 9), "focal"),
    ],
)
def test_invalid_message_is_refused_with_the_reason(
    topic: Topic, message: Message, refusal: str
) -> None:
    with pytest.raises(ValueError, match=refusal):
        decode(topic, message.SerializeToString())


def test_texts_and_times_beside_the_bytes_of_an_image_are_checked() -> None:
    image = RawImage(width=1, height=1, encoding="a\x1b", data=b"\x1b")
    got = decode(topics.CAMERA_DEPTH, image.SerializeToString())
    assert (got.encoding, got.data) == ("a\\x1b", b"\x1b")
    image.timestamp.seconds = 2**62
    with pytest.raises(ValueError, match="timestamp"):
        decode(topics.CAMERA_DEPTH, image.SerializeToString())


def test_unknown_value_of_an_enum_is_refused() -> None:
    command = ArmCommand()
    command.action = 77  # pyright: ignore[reportAttributeAccessIssue]
    with pytest.raises(ValueError, match="action = 77"):
        decode(topics.ARM_COMMAND, command.SerializeToString())


def test_payload_beyond_the_limit_is_not_decoded() -> None:
    with pytest.raises(ValueError, match="more than"):
        decode(topics.ROPE_NODES, b"\0" * (topics.ROPE_NODES.max_size + 1))


def test_no_bytes_raise_anything_but_value_errors() -> None:
    rng = random.Random(0)
    samples = [
        (entry.topic, entry.payload)
        for entry in Recording.open(REFERENCES[-1]).messages()
        if not entry.topic.large
    ]
    refused = 0
    for _ in range(4000):
        topic, payload = rng.choice(samples)
        mutated = bytearray(payload)
        for _ in range(rng.randrange(1, 6)):
            if mutated:
                mutated[rng.randrange(len(mutated))] = rng.randrange(256)
        try:
            decode(topic, bytes(mutated[: rng.randrange(len(mutated) + 1)]))
        except ValueError:
            refused += 1
    assert refused > 1000
