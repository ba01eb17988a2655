"""Layout of Foxglove's and Lichtblick's panels for a recording."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from shared import topics
from shared.cell_description import WORLD_FRAME
from shared.recording import Recording

PLOTS = {
    "Error and clearance": ("task/state.error", "task/state.clearance", "run/result.error"),
    "Stiffness": ("controller/parameters.rod.bending_stiffness.value",),
    "Step times": (
        "health/controller.step_p99_ms",
        "health/robot_gateway.step_p99_ms",
        "health/perception.step_p99_ms",
    ),
}
"""Message paths of the curves of each plot; those without messages are left out."""
CAMERA_DISTANCE = 1.2
"""Distance of the viewpoint from the cell's centre [m]."""
Panel = dict[str, Any]
"""Configuration of a panel."""


def write(recording: Recording, path: Path) -> str:
    """Write the layout to a file; return one line about it."""
    keys = {entry.key for entry in recording.messages()}
    with path.open("x") as stream:
        json.dump(layout(keys), stream, indent=2)
    return f"{path}: import it in Foxglove or Lichtblick as a layout"


def layout(keys: set[str]) -> dict[str, Any]:
    """Return the layout for a recording with messages of some topics."""
    panels: dict[str, Panel] = {"3D!cell": _three_d(keys)}
    for color in sorted(k for k in keys if topics.CAMERA_COLOR.matches(k)):
        name = color.split("/")[1]
        calibration = topics.CAMERA_CALIBRATION.at(name).key
        panels[f"Image!{name}"] = {
            "imageMode": {"imageTopic": color, "calibrationTopic": calibration}
        }
    for title, paths in PLOTS.items():
        plotted = [path for path in paths if path.partition(".")[0] in keys]
        if plotted:
            panels[f"Plot!{title.split()[0].lower()}"] = {
                "title": title,
                "paths": [
                    {"value": p, "enabled": True, "timestampMethod": "receiveTime"} for p in plotted
                ],
                "showLegend": True,
                "isSynced": True,
            }
    panels["StateTransitions!run"] = {
        "paths": [
            {"value": value, "timestampMethod": "receiveTime"}
            for value in ("task/state.state", "arm/state.mode")
            if value.partition(".")[0] in keys
        ],
        "isSynced": True,
    }
    for log in sorted(k for k in keys if topics.LOG.matches(k)):
        panels[f"RosOut!{log.split('/')[1]}"] = {"topicToRender": log}
    first, *rest = panels
    return {
        "configById": panels,
        "globalVariables": {},
        "userNodes": {},
        "playbackConfig": {"speed": 1},
        "layout": {
            "direction": "row",
            "first": first,
            "second": _column(rest),
            "splitPercentage": 60,
        },
    }


def _three_d(keys: set[str]) -> Panel:
    shown = {topics.VIEW_SCENE.key, *(k for k in keys if topics.CAMERA_CALIBRATION.matches(k))}
    names = (k.split("/")[1] for k in keys if topics.CAMERA_CALIBRATION.matches(k))
    depth = {topics.VIEW_POINTS.at(name).key for name in names}
    # The curves are lines already; as points they would be drawn twice.
    clouds = {key: {"visible": key in depth} for key in keys if topics.VIEW_POINTS.matches(key)}
    for settings in clouds.values():
        settings.update({"colorMode": "rgba-fields", "pointSize": 2})
    return {
        "cameraState": {
            "distance": CAMERA_DISTANCE,
            "perspective": True,
            "phi": 55,
            "thetaOffset": 30,
            "targetOffset": [0, 0, 0],
            "target": [0, 0, 0.2],
            "targetOrientation": [0, 0, 0, 1],
            "fovy": 45,
            "near": 0.01,
            "far": 100,
        },
        "followMode": "follow-none",
        "followTf": WORLD_FRAME,
        "scene": {"transforms": {"axisScale": 0.1, "showLabel": False}},
        "topics": {**clouds, **{key: {"visible": True} for key in sorted(shown & keys)}},
        "layers": {
            "grid": {
                "layerId": "foxglove.Grid",
                "frameId": WORLD_FRAME,
                "visible": True,
                "size": 2,
                "divisions": 20,
            }
        },
    }


def _column(names: list[str]) -> Any:
    """Panels one below the other, of the same height."""
    if len(names) == 1:
        return names[0]
    return {
        "direction": "column",
        "first": names[0],
        "second": _column(names[1:]),
        "splitPercentage": 100.0 / len(names),
    }
