"""Joints and bodies of a robot, read from its URDF."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from lariat.files.bounded_file import read_file
from lariat.files.file_kind import known_kind
from lariat.geometry import poses
from lariat.geometry.poses import Pose

MAX_URDF_SIZE = 2**22
"""Largest URDF that is read [bytes]."""
ANGULAR_JOINTS = ("revolute", "continuous")
"""Types of the joints that turn."""
MOVING_JOINTS = (*ANGULAR_JOINTS, "prismatic")
"""Types of the joints that have one value."""


@dataclass(frozen=True)
class Joint:
    """Joint between two links."""

    name: str
    """Name of the joint."""
    type: str
    """Type, as in the URDF: revolute, continuous, prismatic, fixed, …"""
    parent: str
    """Name of the link that carries it."""
    child: str
    """Name of the link that it moves."""
    T_parent_joint: Pose
    """Pose in the parent link at the value 0."""
    axis: tuple[float, float, float]
    """Axis in the joint's frame, of unit length."""

    def T_parent_child(self, value: float) -> Pose:
        """Return the pose of the child link in the parent link.

        Args:
            value: Value of the joint [rad or m]; of no effect on a joint that does not move.
        """
        axis = value * np.array(self.axis)
        if self.type in ANGULAR_JOINTS:
            return self.T_parent_joint @ Pose(np.zeros(3), poses.exponential(axis))
        if self.type == "prismatic":
            return self.T_parent_joint @ Pose(axis, poses.IDENTITY)
        return self.T_parent_joint


@dataclass(frozen=True)
class Body:
    """Primitive body of a link."""

    link: str
    """Name of the link."""
    T_link_body: Pose
    """Pose of its centre in the link; a cylinder's axis is z."""
    shape: str
    """box, cylinder or sphere."""
    size: tuple[float, ...]
    """Edge lengths of a box; radius and length of a cylinder; radius of a sphere [m]."""


class Urdf:
    """Robot of a URDF."""

    def __init__(self, path: Path) -> None:
        """Read a file.

        Raises:
            OSError: It cannot be read.
            ValueError: It is not a URDF, or a joint of it lacks what it needs.
        """
        self.tree = read_robot(path)
        """Root element of the file."""
        try:
            self.joints = tuple(_joint(element) for element in self.tree.iterfind("joint"))
        except ValueError as error:
            raise ValueError(f"{path}: {error}") from error
        """Joints in the order of the file."""

    @cached_property
    def root(self) -> str:
        """Name of the link that no joint moves."""
        children = {joint.child for joint in self.joints}
        links = (_attribute(element, "name") for element in self.tree.iterfind("link"))
        root = next((link for link in links if link not in children), None)
        if root is None:
            raise ValueError("the URDF has no link that carries the others")
        return root

    @cached_property
    def moving(self) -> tuple[Joint, ...]:
        """Joints that have a value, in the order of the file."""
        return tuple(joint for joint in self.joints if joint.type in MOVING_JOINTS)

    @cached_property
    def bodies(self) -> tuple[Body, ...]:
        """Primitives of the links' visual geometry, or of the collision geometry of a link without.

        Meshes are left out.
        """
        return tuple(body for link in self.tree.iterfind("link") for body in _bodies(link))

    def chain(self, link: str) -> tuple[Joint, ...]:
        """Return the joints between the root and a link that are not fixed, in that order.

        Raises:
            ValueError: There is no such link, or the joints above it form a circle.
        """
        above = {joint.child: joint for joint in self.joints}
        if link != self.root and link not in above:
            raise ValueError(f"the URDF has no link {link!r}")
        joints: list[Joint] = []
        while joint := above.pop(link, None):
            joints.append(joint)
            link = joint.parent
        if any(link == joint.child for joint in joints):
            raise ValueError(f"joint {joints[-1].name!r} of the URDF is part of a circle")
        return tuple(joint for joint in reversed(joints) if joint.type != "fixed")

    def link_poses(
        self, joints: Sequence[Joint], values: Sequence[float]
    ) -> Iterator[tuple[str, str, Pose]]:
        """Yield, for each joint, parent link, child link and pose of the child in the parent.

        Args:
            joints: Joints whose values are known; all others are drawn at 0.
            values: Their values [rad or m].
        """
        value_of = dict(zip((joint.name for joint in joints), values, strict=True))
        for joint in self.joints:
            yield joint.parent, joint.child, joint.T_parent_child(value_of.get(joint.name, 0.0))


def read_robot(path: Path) -> ElementTree.Element:
    """Return the root element of a URDF.

    Raises:
        OSError: It cannot be read.
        ValueError: It is no XML of a robot, or is to be expanded by xacro first.
    """
    data = read_file(path, MAX_URDF_SIZE)
    try:
        robot = ElementTree.fromstring(data)
    except ElementTree.ParseError as error:
        reason = f"it is {known_kind(data)}" if known_kind(data) else error
        raise ValueError(f"{path} is not a URDF: {reason}") from error
    if robot.tag != "robot":
        raise ValueError(f"{path} is not a URDF: its root is <{robot.tag}>, not <robot>")
    values = "".join(value for each in robot.iter() for value in each.attrib.values())
    if "${" in values or "$(" in values or any("ros.org" in each.tag for each in robot.iter()):
        raise ValueError(f"{path} is a xacro file; expand it: xacro {path.name} > robot.urdf")
    return robot


def _joint(element: ElementTree.Element) -> Joint:
    name, kind = _attribute(element, "name"), _attribute(element, "type")
    try:
        axis = _numbers(element.find("axis"), "xyz", "1 0 0")
        origin = _origin(element.find("origin"))
    except ValueError as error:
        raise ValueError(f"joint {name!r}: {error}") from error
    length = float(np.linalg.norm(axis))
    if kind in MOVING_JOINTS and not (len(axis) == 3 and 0.0 < length < np.inf):
        raise ValueError(f"joint {name!r}: axis {axis.tolist()} is no direction; give x, y, z")
    x, y, z = (axis / length).tolist() if kind in MOVING_JOINTS else (1.0, 0.0, 0.0)
    links = (element.find("parent"), element.find("child"))
    parent, child = ("" if link is None else link.get("link", "") for link in links)
    if not (parent and child):
        raise ValueError(f"joint {name!r} names no parent or no child link")
    return Joint(name, kind, parent, child, origin, (x, y, z))


def _attribute(element: ElementTree.Element, name: str) -> str:
    value = element.get(name)
    if value is None:
        raise ValueError(f"a <{element.tag}> of the URDF has no {name}")
    return value


def _bodies(link: ElementTree.Element) -> Iterator[Body]:
    for element in link.findall("visual") or link.findall("collision"):
        for shape in element.iterfind("geometry/*"):
            match shape.tag:
                case "box":
                    size = _numbers(shape, "size", "")
                case "cylinder":
                    size = np.array(
                        [float(_attribute(shape, each)) for each in ("radius", "length")]
                    )
                case "sphere":
                    size = np.array([float(_attribute(shape, "radius"))])
                case _:
                    continue
            pose = _origin(element.find("origin"))
            yield Body(_attribute(link, "name"), pose, shape.tag, tuple(size.tolist()))


def _origin(element: ElementTree.Element | None) -> Pose:
    if element is None:
        return Pose(np.zeros(3), poses.IDENTITY)
    roll, pitch, yaw = (
        poses.exponential(angle * axis)
        for angle, axis in zip(_numbers(element, "rpy", "0 0 0"), np.eye(3), strict=True)
    )
    # Rotations about the fixed axes x, y, z, in this order.
    orientation = poses.multiply(yaw, poses.multiply(pitch, roll))
    return Pose(_numbers(element, "xyz", "0 0 0"), orientation)


def _numbers(element: ElementTree.Element | None, key: str, default: str) -> np.ndarray:
    text = default if element is None else element.get(key, default)
    numbers = np.array([float(word) for word in text.split()])
    if not np.isfinite(numbers).all():
        raise ValueError(f"{key} = {text!r} is not finite")
    return numbers
