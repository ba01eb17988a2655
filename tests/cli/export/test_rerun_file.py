"""Export to Rerun: a file with views."""

from __future__ import annotations

from pathlib import Path

import pytest

from cli.export import main
from tests.cli.export.recorded import recording


def test_an_old_recording_becomes_a_file_with_views(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setenv("CI", "1")  # Rerun then sends nothing to its makers.
    file = recording(tmp_path, drawn=False)
    assert main((file,), "rerun", tmp_path / "small.rrd") == 0
    assert b"/view/points/rope" in (tmp_path / "small.rrd").read_bytes()
    assert b"SpatialInformation" in (tmp_path / "small.rbl").read_bytes()
