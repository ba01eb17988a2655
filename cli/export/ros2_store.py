"""ROS 2 messages by their type: those of Humble, which later distributions read."""

from __future__ import annotations

from typing import Any

from rosbags.typesys import Stores, get_typestore

from lariat.trajectory import SECOND

STORE = get_typestore(Stores.ROS2_HUMBLE)
"""Definitions of the messages."""


def ros(kind: str, **fields: Any) -> Any:
    """Create a message, e.g. `ros("std_msgs/msg/String", data="")`."""
    return STORE.types[kind](**fields)


def time(stamp: int) -> Any:
    """Return a time [ns] as a message."""
    return ros("builtin_interfaces/msg/Time", sec=stamp // SECOND, nanosec=stamp % SECOND)


def duration(length: int) -> Any:
    """Return a duration [ns] as a message."""
    return ros("builtin_interfaces/msg/Duration", sec=length // SECOND, nanosec=length % SECOND)


def header(stamp: int, frame: str) -> Any:
    """Return the header of a message that describes a time [ns]."""
    return ros("std_msgs/msg/Header", stamp=time(stamp), frame_id=frame)


def vector(xyz: Any) -> Any:
    """Return three numbers as geometry_msgs/Vector3."""
    x, y, z = map(float, xyz)
    return ros("geometry_msgs/msg/Vector3", x=x, y=y, z=z)


def point(xyz: Any) -> Any:
    """Return three numbers as geometry_msgs/Point [m]."""
    x, y, z = map(float, xyz)
    return ros("geometry_msgs/msg/Point", x=x, y=y, z=z)


def quaternion(wxyz: Any) -> Any:
    """Return a quaternion wxyz as geometry_msgs/Quaternion."""
    w, x, y, z = map(float, wxyz)
    return ros("geometry_msgs/msg/Quaternion", x=x, y=y, z=z, w=w)
