"""`lariat ros2`: the topics, services and actions of a cell's ROS 2 node."""

from __future__ import annotations

import json as jsons
from pathlib import Path
from typing import Annotated

import tyro

from lariat.scenario.settings import load_with
from shared.ros2.table import Table, shown
from shared.ros2.wire import Qos


def main(
    scenario: tyro.conf.Positional[Path | None] = None,
    /,
    json: bool = False,
    set: Annotated[
        tyro.conf.UseAppendAction[tuple[str, ...]], tyro.conf.arg(metavar="KEY=VALUE")
    ] = (),
) -> int:
    """List what the ROS 2 node of `lariat up --ros2` publishes and takes.

    Names without leading slash lie in the node's namespace; NAME is that of a camera.
    Keys are those of `[ros2.topics]` in a scenario, which changes names, rates and qualities.

    Examples:
      lariat ros2
      lariat ros2 three-cylinders

    Args:
        scenario: Scenario with changes; by default none.
        json: Print one JSON object instead.
        set: Replaces one value of the scenario; may be repeated.
    """
    loaded = load_with(scenario, set) if scenario else None
    table = Table.of(loaded) if loaded else Table()
    plain = Table()
    rows = [("out", plain.description, table.description)]
    rows += [("out", *pair) for pair in zip(plain.outputs, table.outputs, strict=True)]
    rows += [("in", row, table.inputs[key]) for key, row in plain.inputs.items()]
    columns = ("direction", "key", "name", "type", "qos", "meaning")
    cells = [
        (
            direction,
            shown(before.name),
            shown(row.name),
            row.type,
            _quality(row.qos, getattr(row, "rate", None)),
            row.meaning,
        )
        for direction, before, row in rows
    ]
    settings = table.settings
    if json:
        listed = [dict(zip(columns, row, strict=True)) for row in cells]
        frames = {"world_frame": settings.world_frame, "frame_prefix": settings.frame_prefix}
        print(jsons.dumps({"namespace": settings.namespace, **frames, "topics": listed}))
        return 0
    prefix = f", others with the prefix {settings.frame_prefix}" * bool(settings.frame_prefix)
    print(f"namespace {settings.namespace}; frame {settings.world_frame}{prefix}")
    print("`in` with --ros2-commands only")
    # The key stands beside the name only where they differ.
    rows = [
        (d, name if name == key else f"{name} (key {key})", *rest) for d, key, name, *rest in cells
    ]
    widths = [max(len(row[k]) for row in rows) for k in range(4)]
    for row in rows:
        padded = "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=False))
        print(f"{padded}  {row[-1]}")
    return 0


def _quality(qos: Qos | None, rate: float | None) -> str:
    if qos is None:
        return ""
    kind = "latched" if qos.latched else "reliable" if qos.reliable else "best effort"
    return f"{kind}, {qos.depth}" + (f", {rate:g} Hz" if rate else "")
