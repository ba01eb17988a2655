"""Layout of panels for a recording."""

from __future__ import annotations

import json
from pathlib import Path

from cli.export import main
from shared.recording import Recording
from tests.cli.export.recorded import recording


def leaves(node) -> list[str]:
    return [node] if isinstance(node, str) else [*leaves(node["first"]), *leaves(node["second"])]


def test_every_panel_is_placed_and_shows_topics_of_the_recording(tmp_path: Path):
    file = recording(tmp_path)
    assert main((file,), "foxglove-layout", tmp_path / "layout.json") == 0
    layout = json.loads((tmp_path / "layout.json").read_text())
    panels = layout["configById"]
    assert sorted(leaves(layout["layout"])) == sorted(panels)
    keys = {entry.key for entry in Recording(file).messages()}
    view = panels["3D!cell"]
    assert set(view["topics"]) <= keys
    shown = {key for key, settings in view["topics"].items() if settings["visible"]}
    assert shown == {"view/scene", "view/points/overhead", "camera/overhead/calibration"}
    assert panels["Image!overhead"]["imageMode"]["imageTopic"] == "camera/overhead/color"
    assert panels["RosOut!sim"] == {"topicToRender": "log/sim"}
    # There is no run/result in it.
    paths = [path["value"] for path in panels["Plot!error"]["paths"]]
    assert paths == ["task/state.error", "task/state.clearance"]
