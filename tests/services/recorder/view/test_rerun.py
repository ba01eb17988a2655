"""A recording in Rerun: its own converter yields points, transforms, camera and arms.

The test runs where the command `rerun` is installed: rerun-sdk takes 0.7 GB with what it needs,
more than all else that the tests install.
"""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from collections import defaultdict
from pathlib import Path

import pytest

from shared.recording import Writer
from shared.scenario.cameras import DEFAULT_CAMERA
from tests.services.recorder.view import cell

RERUN = shutil.which("rerun") or shutil.which("rerun", path=str(Path(sys.executable).parent))
pytestmark = pytest.mark.skipif(
    RERUN is None, reason="no `rerun`; install the extra `viewers` of stack/pyproject.toml"
)
CURVES = ("rope", "truth", "goal", "prediction", "path")


def recording(folder: Path) -> Path:
    """Recording of one message of each topic, and of what is drawn of them."""
    scenario = cell.scenario(folder)
    writer = Writer(folder / "drawn.mcap", scenario, cell.NOW)
    said = [*cell.messages(scenario), *cell.view(scenario).draw(cell.NOW)]
    for topic, message in said:
        payload = message.SerializeToString()
        writer.write(topic, payload, "test-0", 0, cell.NOW, cell.NOW - 10_000_000)
    writer.close()
    return writer.path


def rerun(*words: str) -> str:
    assert RERUN
    done = subprocess.run([RERUN, *words], capture_output=True, text=True, timeout=120, check=True)
    return done.stdout


def components(rrd: Path) -> dict[str, set[str]]:
    """Names of the components of each entity."""
    found: dict[str, set[str]] = defaultdict(set)
    line = r"\) - (\S+) - data columns: \[(.*?)\]"
    for entity, names in re.findall(line, rerun("rrd", "print", str(rrd))):
        found[entity].update(names.split())
    return found


def test_reruns_converter_yields_points_transforms_depth_and_arms(tmp_path: Path):
    path = recording(tmp_path)
    rerun("mcap", "convert", str(path), "-o", str(tmp_path / "drawn.rrd"))
    found = components(tmp_path / "drawn.rrd")
    for name in (*CURVES, "obstacles", DEFAULT_CAMERA):
        assert {"Points3D:positions", "Points3D:colors", "CoordinateFrame:frame"} <= found[
            f"/view/points/{name}"
        ]
    assert {"Transform3D:parent_frame", "Transform3D:child_frame"} <= found["/view/transforms"]
    assert "Image:buffer" in found["/camera/overhead/depth"]
    assert "Pinhole:image_from_camera" in found["/camera/overhead/calibration"]
    drawn = {name for name in found if "/visual_geometries/" in name}
    assert {rf"/cell/visual_geometries/right\/link_{k}/visual_0" for k in range(1, 7)} <= drawn
    assert r"/cell/visual_geometries/left\/grip/visual_0" in drawn


def test_rerun_finds_no_fault_with_the_file(tmp_path: Path):
    answer = rerun("mcap", "check", "--full", str(recording(tmp_path)))
    rows = [line for line in answer.splitlines() if "view/" in line or "camera/" in line]
    assert len(rows) > 10
    assert all(row.startswith("ok") for row in rows)
