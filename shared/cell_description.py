"""Description of a cell's arms and grippers as one URDF, and the names of its frames.

The root link is `world`. The links of an arm that has a URDF are named `{side}/{link}` and hang on
the world by a fixed joint; a gripper is the link `{side}/grip`, which floats in the world, because
the gateway states its pose.
"""

from __future__ import annotations

import copy
import logging
from functools import cache
from pathlib import Path
from xml.etree import ElementTree

from lariat.arms.description import arm_description
from lariat.arms.urdf import Urdf
from lariat.geometry import poses
from lariat.geometry.poses import Pose
from lariat.scenario import SIDES, Scenario, Side
from lariat.scenario.placement import base_of

log = logging.getLogger(__name__)

WORLD_FRAME = "world"
"""Name of the frame of the world."""
GRIP = "grip"
"""Name of a gripper's link, without its side."""
GRIPPER_COLOR = (0.85, 0.2, 0.3, 1.0)
"""Colour of the grippers: red, green, blue, alpha [-]."""
ARM_COLOR = (0.75, 0.77, 0.8, 1.0)
"""Colour of the arms' links: red, green, blue, alpha [-]."""
AWAY_FROM_ROPE = {"left": -1.0, "right": 1.0}
"""Direction of a gripper's body along the z axis of its grip, which points along the rope from left
to right."""


def frame_name(side: Side, link: str) -> str:
    """Return the name of the frame of an arm's link or of its gripper."""
    return f"{side}/{link}"


def arm_urdf(scenario: Scenario, side: Side) -> Urdf | None:
    """Return the URDF of the arm at an end; None where there is none, or it cannot be read here."""
    description = arm_description(scenario, side)
    if description is None:
        return None
    try:
        return _read(description.urdf)
    except (OSError, ValueError) as error:
        # A recording's scenario may name a file of another machine.
        log.warning("the %s arm is not drawn: %s", side, error)
        return None


def cell_urdf(scenario: Scenario) -> str:
    """Return the URDF of a cell's arms and grippers."""
    robot = ElementTree.Element("robot", name="cell")
    ElementTree.SubElement(robot, "link", name=WORLD_FRAME)
    for side in SIDES:
        if (arm := arm_urdf(scenario, side)) is not None:
            _add_arm(robot, side, arm, base_of(scenario.end(side)))
        _add_gripper(robot, side, scenario)
    ElementTree.indent(robot)
    return ElementTree.tostring(robot, encoding="unicode", xml_declaration=True)


@cache
def _read(path: Path) -> Urdf:
    return Urdf(path)


def _add_arm(robot: ElementTree.Element, side: Side, arm: Urdf, T_world_base: Pose) -> None:
    _add_joint(robot, "fixed", f"{side}/base", frame_name(side, arm.root), T_world_base)
    for element in arm.tree:
        if element.tag not in ("link", "joint"):
            continue
        part = copy.deepcopy(element)
        part.set("name", frame_name(side, part.attrib["name"]))
        for reference in (*part.iterfind("parent"), *part.iterfind("child")):
            reference.set("link", frame_name(side, reference.attrib["link"]))
        for mimic in part.iterfind("mimic"):
            mimic.set("joint", frame_name(side, mimic.attrib["joint"]))
        # A viewer does not find the files of meshes: the drawing of the cell has their hulls.
        for shown in [*part.findall("visual"), *part.findall("collision")]:
            if shown.find("geometry/mesh") is not None:
                part.remove(shown)
        # Viewers draw the visual geometry only.
        if part.tag == "link" and part.find("visual") is None:
            for collision in part.findall("collision"):
                visual = copy.deepcopy(collision)
                visual.tag = "visual"
                part.append(_colored(visual, ARM_COLOR))
        robot.append(part)


def _add_gripper(robot: ElementTree.Element, side: Side, scenario: Scenario) -> None:
    limits, name = scenario.limits, frame_name(side, GRIP)
    link = ElementTree.SubElement(robot, "link", name=name)
    visual = ElementTree.SubElement(link, "visual")
    middle = AWAY_FROM_ROPE[side] * limits.gripper_height / 2.0
    ElementTree.SubElement(visual, "origin", xyz=f"0 0 {middle:g}")
    geometry = ElementTree.SubElement(visual, "geometry")
    ElementTree.SubElement(
        geometry,
        "cylinder",
        radius=f"{limits.gripper_radius:g}",
        length=f"{limits.gripper_height:g}",
    )
    _colored(visual, GRIPPER_COLOR)
    start = dict(zip(SIDES, scenario.grips(scenario.start), strict=True))[side]
    _add_joint(robot, "floating", f"{side}/{GRIP}", name, start)


def _colored(
    visual: ElementTree.Element, color: tuple[float, float, float, float]
) -> ElementTree.Element:
    material = ElementTree.SubElement(visual, "material", name=" ".join(f"{c:g}" for c in color))
    ElementTree.SubElement(material, "color", rgba=" ".join(f"{c:g}" for c in color))
    return visual


def _add_joint(
    robot: ElementTree.Element, kind: str, name: str, child: str, T_world_child: Pose
) -> None:
    joint = ElementTree.SubElement(robot, "joint", name=name, type=kind)
    ElementTree.SubElement(joint, "parent", link=WORLD_FRAME)
    ElementTree.SubElement(joint, "child", link=child)
    angles = poses.roll_pitch_yaw(poses.matrix(T_world_child.orientation))
    xyz, rpy = (" ".join(f"{v:.9g}" for v in vector) for vector in (T_world_child.position, angles))
    ElementTree.SubElement(joint, "origin", xyz=xyz, rpy=rpy)
