"""A recording in Rerun: its own converter yields points, transforms, camera and arms."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rerun.chunk import McapReader

from lariat.scenario.cameras import DEFAULT_CAMERA
from shared.recording import Writer
from tests.services.recorder.view import cell

CURVES = ("rope", "truth", "goal", "prediction", "path")
LINE = np.linspace([-0.2, 0.0, 0.3], [0.2, 0.0, 0.3], 4)
"""Nodes of the rope in `cell.messages` [m]."""


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Recording of one message of each topic, and of what is drawn of them."""
    folder = tmp_path_factory.mktemp("rerun")
    scenario = cell.scenario(folder)
    writer = Writer(folder / "drawn.mcap", scenario, cell.NOW)
    said = [*cell.messages(scenario), *cell.view(scenario).draw(cell.NOW)]
    for topic, message in said:
        payload = message.SerializeToString()
        writer.write(topic, payload, "test-0", 0, cell.NOW, cell.NOW - 10_000_000)
    writer.close()
    return writer.path


@pytest.fixture(scope="module")
def entities(recording: Path) -> dict[str, dict[str, list[Any]]]:
    """Components of each entity that Rerun's converter makes of the recording, row by row."""
    found: dict[str, dict[str, list[Any]]] = {}
    for chunk in McapReader(recording).stream():
        found.setdefault(chunk.entity_path, {}).update(chunk.to_record_batch().to_pydict())
    return found


def test_curves_are_points_where_their_nodes_are(entities: dict[str, dict[str, list[Any]]]):
    for name in CURVES:
        cloud = entities[f"/view/points/{name}"]
        assert cloud["CoordinateFrame:frame"] == [["world"]]
        assert len(cloud["Points3D:colors"][0]) == len(cloud["Points3D:positions"][0]) >= 4
    rope = entities["/view/points/rope"]
    np.testing.assert_allclose(rope["Points3D:positions"][0], LINE, atol=1e-7)
    goal = entities["/view/points/goal"]
    np.testing.assert_allclose(goal["Points3D:positions"][0], LINE + 0.1, atol=1e-7)


def test_the_colour_of_the_rope_tells_its_deviation(entities: dict[str, dict[str, list[Any]]]):
    (colors,) = entities["/view/points/rope"]["Points3D:colors"]
    assert len(set(colors[:3])) == 3
    assert colors[2] == colors[3]  # 2 mm and 9 m: the scale ends at 2 mm.


def test_frames_lead_from_the_world_to_the_last_link(entities: dict[str, dict[str, list[Any]]]):
    frames = entities["/view/transforms"]
    (parents, children) = (
        [row[0] for row in frames[f"Transform3D:{key}_frame"]] for key in ("parent", "child")
    )
    parent = dict(zip(children, parents, strict=True))
    assert parent["right/link_6"] == "right/link_5"
    assert parent["right/link_1"] == "right/base_link"
    assert {parent[name] for name in ("right/base_link", "right/grip", DEFAULT_CAMERA)} == {"world"}
    camera = children.index(DEFAULT_CAMERA)
    np.testing.assert_allclose(frames["Transform3D:translation"][camera], [[0, 0, 1]], atol=1e-7)


def test_depth_is_a_picture_and_points_on_the_table(entities: dict[str, dict[str, list[Any]]]):
    depth = entities["/camera/overhead/depth"]
    pixels = np.array(depth["Image:buffer"][0][0], np.uint8).view("<u2")
    assert pixels[0] == 0
    assert set(pixels[1:].tolist()) == {1000}
    pinhole = entities["/camera/overhead/calibration"]
    assert pinhole["Pinhole:parent_frame"] == [[DEFAULT_CAMERA]]
    assert depth["CoordinateFrame:frame"] == pinhole["Pinhole:child_frame"]
    assert pinhole["Pinhole:image_from_camera"][0][0][0] == cell.FOCAL
    cloud = entities[f"/view/points/{DEFAULT_CAMERA}"]
    assert cloud["CoordinateFrame:frame"][0][0] in ("world", DEFAULT_CAMERA)


def test_arms_and_grippers_are_bodies(entities: dict[str, dict[str, list[Any]]]):
    drawn = {name for name in entities if "/visual_geometries/" in name}
    assert {rf"/cell/visual_geometries/right\/link_{k}/visual_0" for k in range(1, 7)} <= drawn
    assert r"/cell/visual_geometries/left\/grip/visual_0" in drawn


def test_rerun_finds_no_fault_with_the_file(recording: Path):
    # In continuous integration Rerun's command sends nothing to its makers.
    answer = subprocess.run(
        [sys.executable, "-m", "rerun", "mcap", "check", "--full", str(recording)],
        capture_output=True,
        text=True,
        check=True,
        env={**os.environ, "CI": "1"},
    ).stdout
    rows = [line for line in answer.splitlines() if "view/" in line or "camera/" in line]
    assert len(rows) > 10
    assert all(row.startswith("ok") for row in rows)
