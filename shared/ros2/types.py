"""Types of ROS 2 by their name, e.g. `sensor_msgs/msg/JointState`: construction, CDR and hashes.

Messages of the common packages come from `rosbags`; services and actions are defined here from the
text of their files.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path
from typing import Any, cast

import numpy as np
from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from lariat.trajectory import SECOND
from shared.ros2.interfaces import ACTIONS, MESSAGES, SERVICES

STORE = get_typestore(Stores.ROS2_JAZZY)
"""Definitions of the messages; those that Lariat uses are the same from Humble to Lyrical."""
ACTION_PACKAGE = Path(__file__).parent / "lariat_interfaces"
"""Package for colcon with Lariat's own actions."""
CDR_HEADER = b"\x00\x01\x00\x00"
"""First bytes of every message."""
MAX_PADDING = 64
"""Most bytes after the last field of a message."""
FOLLOW_TRAJECTORY = "control_msgs/action/FollowJointTrajectory"
"""Action that executes a trajectory of the joints."""
TRIGGER = "std_srvs/srv/Trigger"
"""Service that does one thing and says whether it could."""
SHAPE_ROPE = "lariat_interfaces/action/ShapeRope"
"""Action that sets a goal and reports until the rope has it."""


def define_service(name: str, text: str) -> None:
    """Define a service from the text of its file: request, `---`, response."""
    request, response = text.split("---")
    _register(
        {
            f"{name}_Request": request,
            f"{name}_Response": response,
            f"{name}_Event": f"service_msgs/msg/ServiceEventInfo info\n"
            f"{name}_Request[<=1] request\n{name}_Response[<=1] response",
            name: f"{name}_Request request_message\n{name}_Response response_message\n"
            f"{name}_Event event_message",
        }
    )


def define_action(name: str, text: str) -> None:
    """Define an action from the text of its file: goal, `---`, result, `---`, feedback."""
    goal, result, feedback = text.split("---")
    parts = {"Goal": goal, "Result": result, "Feedback": feedback}
    _register({f"{name}_{part}": fields for part, fields in parts.items()})
    uuid = "unique_identifier_msgs/msg/UUID goal_id\n"
    stamp = "builtin_interfaces/msg/Time stamp"
    define_service(f"{name}_SendGoal", f"{uuid}{name}_Goal goal\n---\nbool accepted\n{stamp}")
    define_service(f"{name}_GetResult", f"{uuid}---\nint8 status\n{name}_Result result")
    _register({f"{name}_FeedbackMessage": f"{uuid}{name}_Feedback feedback"})


def ros(kind: str, **fields: Any) -> Any:
    """Create a message, e.g. `ros("std_msgs/msg/String", data="a")`.

    A field that is not given is zero, false or empty.
    """
    zeros = _zeros(kind)
    return STORE.types[kind](**(fields if len(fields) == len(zeros) else zeros | fields))


@dataclass(frozen=True)
class Rows:
    """Last field of a message, a sequence without an object for each of its elements."""

    counts: tuple[int, ...]
    """Number of elements, and of those with which the first one begins."""
    data: np.ndarray
    """The bytes that follow."""
    alignment: int = 8
    """Their alignment [bytes]."""


_NOTHING = np.zeros(0)


def encoded(message: Any) -> bytes | bytearray:
    """Return the CDR of a message, whose last field may be `Rows`."""
    kind = message.__msgtype__
    last = STORE.fielddefs[kind][1][-1][0]
    rows = getattr(message, last)
    if not isinstance(rows, Rows):
        view = STORE.serialize_cdr(message, kind, little_endian=True)
        return cast("bytearray", view.obj)
    setattr(message, last, _NOTHING)
    empty = encoded(message)
    setattr(message, last, rows)
    head = empty[:-4] + struct.pack(f"<{len(rows.counts)}I", *rows.counts)
    # Alignment counts from the end of the header.
    padding = bytes((len(CDR_HEADER) - len(head)) % rows.alignment)
    # Each byte of an image is copied once.
    return b"".join((head, padding, np.ascontiguousarray(rows.data)))


def decoded(payload: bytes | bytearray, kind: str) -> Any:
    """Return the message of a CDR."""
    try:
        definition = STORE.get_msgdef(kind)
        if payload[:4] != CDR_HEADER:
            raise ValueError("it is not little-endian CDR")
        message, end = definition.deserialize_cdr_le(payload[4:], 0, definition.cls, STORE)
        # Fast CDR makes room for the alignment of elements that empty sequences do not have.
        if len(payload) - 4 - end > MAX_PADDING:
            raise ValueError(f"it has {len(payload) - 4 - end} bytes too many")
    # A message of others can fail in any way.
    except Exception as error:
        raise ValueError(f"{len(payload)} bytes are no {kind}: {error}") from None
    return message


@cache
def type_hash(kind: str) -> str:
    """Return the hash of a message or service (REP 2011), `RIHS01_…`."""
    return STORE.hash_rihs01(kind)


def dds_name(kind: str) -> str:
    """Return the name of a type on the wire, e.g. `std_msgs::msg::dds_::String_`."""
    package, folder, name = kind.split("/")
    return f"{package}::{folder}::dds_::{name}_"


def time(length: int, kind: str = "Time") -> Any:
    """Return a time, or what else is a `kind`, [ns] as a message."""
    return ros(f"builtin_interfaces/msg/{kind}", sec=length // SECOND, nanosec=length % SECOND)


def nanoseconds(message: Any) -> int:
    """Return a Time or Duration [ns]."""
    return message.sec * SECOND + message.nanosec


duration = partial(time, kind="Duration")


def header(stamp: int, frame: str) -> Any:
    """Return the header of a message that describes a time [ns]."""
    return ros("std_msgs/msg/Header", stamp=time(stamp), frame_id=frame)


def vector(xyz: Any) -> Any:
    """Return three numbers as geometry_msgs/Vector3."""
    x, y, z = map(float, xyz)
    return ros("geometry_msgs/msg/Vector3", x=x, y=y, z=z)


def xyz(message: Any) -> tuple[float, float, float]:
    """Return the numbers of a Point or Vector3."""
    return message.x, message.y, message.z


def wxyz(message: Any) -> tuple[float, float, float, float]:
    """Return the quaternion of a Quaternion."""
    return message.w, message.x, message.y, message.z


@cache
def _zeros(kind: str) -> dict[str, Any]:
    return {name: _zero(*field) for name, field in STORE.fielddefs[kind][1]}


def _zero(node: Nodetype, content: Any) -> Any:
    """Value of a field that is not given."""
    if node is Nodetype.NAME:
        return ros(content)
    if node is Nodetype.BASE:
        return "" if content[0] in ("string", "wstring") else 0
    (inner, element), count = content
    if inner is Nodetype.BASE and element[0] not in ("string", "wstring"):
        return np.zeros(count, {"byte": "u1", "char": "u1"}.get(element[0], element[0]))
    return [_zero(inner, element) for _ in range(count)]


def _register(texts: dict[str, str]) -> None:
    definitions: dict[str, Any] = {}
    for name, text in texts.items():
        definitions |= get_types_from_msg(text, name)
    STORE.register(_named(definitions))


def _named(definition: Any) -> Any:
    """Definition without the folder `msg` that `rosbags` adds to names of services and actions."""
    if isinstance(definition, str):
        return definition.replace("/srv/msg/", "/srv/").replace("/action/msg/", "/action/")
    if isinstance(definition, dict):
        return {_named(key): _named(value) for key, value in definition.items()}
    if isinstance(definition, tuple | list):
        return type(definition)(map(_named, definition))
    return definition


# `char` is `uint8` in ROS 2, which the hash of every service contains.
STORE.fielddefs |= get_types_from_msg(
    """
    uint8 event_type
    builtin_interfaces/msg/Time stamp
    uint8[16] client_gid
    int64 sequence_number
    """,
    "service_msgs/msg/ServiceEventInfo",
)
for _name, _text in MESSAGES.items():
    _register({_name: _text})
for _name, _text in SERVICES.items():
    define_service(_name, _text)
for _name, _text in ACTIONS.items():
    define_action(_name, _text)
define_action(SHAPE_ROPE, (ACTION_PACKAGE / "action/ShapeRope.action").read_text())
