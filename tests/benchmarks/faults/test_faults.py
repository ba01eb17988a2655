"""Faults injected into the whole live stack, judged by the emulated arm's own log of its joints."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from benchmarks.faults.cases import CASES
from benchmarks.faults.joint_log import JointLog
from lariat.safety.guard.stop_causes import STOP_CAUSES

pytestmark = pytest.mark.live


def log_of(speeds: np.ndarray) -> JointLog:
    """A log of one joint that moves at these speeds, 8 ms apart, from 100 s on."""
    joints = np.zeros((len(speeds), 6))
    joints[:, 0] = 0.008 * np.cumsum(speeds)
    return JointLog(100.0 + 0.008 * np.arange(len(speeds)), joints, speeds)


def test_braking_is_read_where_the_speed_falls_and_not_where_it_still_grows() -> None:
    t = 0.008 * np.arange(250)
    # It grows until 0.5 s, is constant until 1 s, and then falls to rest within 0.2 s.
    speeds = np.interp(t, [0.0, 0.5, 1.0, 1.2], [0.0, 1.0, 1.0, 0.0])
    log = log_of(speeds)
    assert log.braking_after(100.9, 102.0) == pytest.approx(0.1, abs=0.025)
    assert log.braking_after(100.3, 102.0) == pytest.approx(0.7, abs=0.025)
    assert log.braking_after(101.1, 102.0) == pytest.approx(0.0, abs=0.03)
    assert log.rest_after(100.9, 102.0) == pytest.approx(0.3, abs=0.02)
    assert log.rest_after(100.9, 101.1) is None
    assert log.moved(101.3, 101.9) == 0.0
    assert log.moved(100.6, 100.8) == pytest.approx(0.2, abs=0.01)


def test_log_that_ends_in_the_middle_of_a_row_is_read_up_to_there(tmp_path: Path) -> None:
    row = ",".join(["1.0", "7", *["0.1"] * 12])
    file = tmp_path / "joints.csv"
    file.write_text(f"head\n{row}\n{row}\n1.016,7,0.1", encoding="utf-8")
    log = JointLog.read(file)
    assert len(log.time) == 2
    assert log.speed.tolist() == [0.1, 0.1]


def test_every_expected_cause_is_a_row_of_the_table() -> None:
    for case in CASES.values():
        assert set(case.causes) - {""} <= set(STOP_CAUSES)


def test_arm_brakes_in_time_and_waits_for_a_person_when_gateway_or_line_fail() -> None:
    # The death of the controller: tests/cli/test_live_stack.py.
    cases = ("gateway-frozen", "line-cut")
    command = [sys.executable, "-m", "cli", "bench", "faults", "--json"]
    command += ["--cases", *cases]
    said = subprocess.run(command, capture_output=True, text=True, timeout=230.0)
    assert said.stdout, said.stderr
    results = {f["case"]: f for f in json.loads(said.stdout)["faults"]}
    for name in cases:
        assert name in results, said.stderr
        assert results[name]["ok"], results[name]["failure"]
    assert all(f["resumed"] == "acknowledged" for f in results.values())
