"""Types of ROS 2: hashes are those that rclpy's packages state, bytes those of CDR."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage

from shared.messages import ArmSetpoints, NodeChain, Setpoints
from shared.ros2.outputs import outputs
from shared.ros2.types import (
    STORE,
    Rows,
    dds_name,
    decoded,
    define_action,
    encoded,
    header,
    ros,
    type_hash,
    vector,
)

FIBONACCI = "test_msgs/action/Fibonacci"


@pytest.fixture(scope="module", autouse=True)
def fibonacci():
    define_action(FIBONACCI, "int32 order\n---\nint32[] sequence\n---\nint32[] sequence")


# From the JSON files of the packages ros-std-msgs 5.5.1, ros-std-srvs and ros-test-msgs 2.3.0.
@pytest.mark.parametrize(
    ("kind", "begins"),
    [
        ("std_msgs/msg/String", "df668c740482bbd48fb39d76a70dfd4b"),
        ("std_srvs/srv/Trigger", "eeff2cd6fa5ad9d27cdf4dec64818317"),
        ("service_msgs/msg/ServiceEventInfo", "41bcbbe07a75c9b52bc96bfd5c24d7f0"),
        (f"{FIBONACCI}_SendGoal", "d807633803e38"),
        (f"{FIBONACCI}_GetResult", "5d30fdeb21d20"),
        (f"{FIBONACCI}_FeedbackMessage", "37487bae8cea3"),
    ],
)
def test_hashes_are_those_of_the_packages(kind: str, begins: str):
    assert type_hash(kind).startswith(f"RIHS01_{begins}")


def test_names_on_the_wire_have_the_namespace_dds():
    assert dds_name("std_msgs/msg/String") == "std_msgs::msg::dds_::String_"
    assert dds_name(f"{FIBONACCI}_SendGoal") == "test_msgs::action::dds_::Fibonacci_SendGoal_"


def test_a_message_returns_from_its_bytes():
    sent = ros(
        "geometry_msgs/msg/PoseArray",
        header=ros(
            "std_msgs/msg/Header",
            stamp=ros("builtin_interfaces/msg/Time", sec=1, nanosec=2),
            frame_id="world",
        ),
        poses=[ros("geometry_msgs/msg/Pose", position=vector((0.1, 0.2, 0.3)))],
    )
    payload = encoded(sent)
    assert payload[:4] == b"\x00\x01\x00\x00"
    got = decoded(payload, "geometry_msgs/msg/PoseArray")
    assert (got.header.stamp.nanosec, got.poses[0].position.z) == (2, 0.3)


@pytest.mark.parametrize(
    "frame", ["w", "wo", "wor", "worl", "world", "world_", "world_1", "world_12"]
)
@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("rope/poses", NodeChain(positions=[0, 0, 0, 1, 0, 0, 2, 0.5, 0])),
        (
            "arm/setpoints",
            Setpoints(
                t0=-1,
                dt=7,
                arms=[
                    ArmSetpoints(arm="left", positions=range(9), orientations=range(12)),
                    ArmSetpoints(arm="right", positions=range(6), orientations=range(8)),
                ],
            ),
        ),
        ("arm/setpoints", Setpoints(arms=[ArmSetpoints(arm="left")])),
        ("camera/{name}/depth/image_raw", RawImage(data=b"abc", encoding="16UC1")),
    ],
    ids=["poses", "trajectory", "empty", "image"],
)
def test_rows_have_the_bytes_of_their_objects(name: str, message: Any, frame: str):
    (row,) = (output for output in outputs() if output.name == name)
    sent = row.convert(message)
    sent.header.frame_id = frame
    payload = encoded(sent)
    got = decoded(payload, row.type)
    assert not any(isinstance(value, Rows) for value in vars(got).values())
    assert encoded(got) == payload


def test_padding_of_an_empty_sequence_at_the_end_is_taken():
    # As rclpy 9.1.2 ends it: room for the alignment of doubles that are not there.
    joints = ros(
        "sensor_msgs/msg/JointState",
        header=header(0, ""),
        name=["a"],
        position=np.zeros(1),
    )
    payload = encoded(joints)
    assert decoded(
        payload + b"\x88\x7f\x00\x00\xe0\x00\x00\x00", "sensor_msgs/msg/JointState"
    ).name == ["a"]
    with pytest.raises(ValueError, match="too many"):
        decoded(payload + bytes(65), "sensor_msgs/msg/JointState")


@pytest.mark.parametrize("cut", [0, 3, 4, 9, 40])
def test_bytes_that_are_no_message_are_refused(cut: int):
    text = encoded(ros("std_msgs/msg/String", data="a" * 60))
    with pytest.raises(ValueError, match="std_msgs/msg/String"):
        decoded(text[:cut], "std_msgs/msg/String")


def test_lengths_that_a_message_only_claims_allocate_nothing():
    claim = b"\x00\x01\x00\x00" + np.array([2**31], "<u4").tobytes()
    with pytest.raises(ValueError, match="PoseArray"):
        decoded(claim * 3, "geometry_msgs/msg/PoseArray")


def test_every_type_of_the_table_is_known():
    assert {output.type for output in outputs()} <= set(STORE.types)
