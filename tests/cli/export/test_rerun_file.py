"""Export to Rerun, where it is installed."""

from __future__ import annotations

from pathlib import Path

import pytest

from cli.export import main
from tests.cli.export.recorded import recording

pytest.importorskip("rerun", reason="no rerun; install the extra `viewers` of stack/pyproject.toml")


def test_an_old_recording_becomes_a_file_with_views(tmp_path: Path):
    file = recording(tmp_path, drawn=False)
    assert main((file,), "rerun", tmp_path / "small.rrd") == 0
    assert b"/view/points/rope" in (tmp_path / "small.rrd").read_bytes()
    assert b"SpatialInformation" in (tmp_path / "small.rbl").read_bytes()
