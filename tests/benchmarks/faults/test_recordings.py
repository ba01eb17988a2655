"""Recordings of a live stack that is stopped, and whose recorder is killed, on a busy machine."""

from __future__ import annotations

import json
import subprocess
import sys

import pytest

pytestmark = pytest.mark.live


def test_a_stop_loses_nothing_and_a_killed_recorder_no_more_than_a_second() -> None:
    command = [sys.executable, "-m", "cli", "bench", "faults", "recordings", "--json"]
    command += ["--cases", "SIGHUP", "kill -9 of the recorder", "--seconds", "2"]
    said = subprocess.run(command, capture_output=True, text=True, timeout=200.0)
    assert said.stdout, said.stderr
    stopped, killed = json.loads(said.stdout)["recordings"]
    assert stopped["recorded_s"] > 1.0
    assert stopped["lost_s"] == 0.0
    assert stopped["ended_s"] < 10.0
    assert killed["recorded_s"] > 0.5
    assert killed["lost_s"] <= 1.0
