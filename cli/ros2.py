"""`lariat ros2`: the topics, services and actions of the cell's ROS 2 node."""

from __future__ import annotations

import json as jsons

from services.ros2.commands import INPUTS
from services.ros2.options import Ros2Options
from shared.ros2.outputs import ROBOT_DESCRIPTION, outputs
from shared.ros2.wire import LATCHED, Qos


def main(json: bool = False) -> int:
    """List what the ROS 2 node of `lariat up --ros2` publishes and takes.

    Names without leading slash lie in the node's namespace; NAME is that of a camera or a curve.

    Examples:
      lariat ros2

    Args:
        json: Print one JSON object instead.
    """
    namespace = Ros2Options().ros_namespace
    rows = [("out", ROBOT_DESCRIPTION, "std_msgs/msg/String", _quality(LATCHED), "URDF")]
    rows += [
        ("out", o.name.replace("{name}", "NAME"), o.type, _quality(o.qos), o.meaning)
        for o in outputs()
    ]
    rows += [("in", name, kind, "", meaning) for name, kind, meaning in INPUTS]
    if json:
        keys = ("direction", "name", "type", "qos", "meaning")
        table = [dict(zip(keys, row, strict=True)) for row in rows]
        print(jsons.dumps({"namespace": namespace, "topics": table}))
        return 0
    print(f"namespace {namespace}; `in` with --ros2-commands only")
    widths = [max(len(row[k]) for row in rows) for k in range(4)]
    for row in rows:
        padded = "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=False))
        print(f"{padded}  {row[-1]}")
    return 0


def _quality(qos: Qos) -> str:
    return "latched" if qos.latched else "reliable" if qos.reliable else "best effort"
