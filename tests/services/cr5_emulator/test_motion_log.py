"""The emulator's own log is what the joints did."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from services.cr5_emulator.emulator import Emulator
from services.cr5_emulator.motion_log import MotionLog
from services.cr5_emulator.options import EmulatorOptions


def test_log_has_a_row_for_every_tick_and_goes_on_after_a_restart(tmp_path: Path) -> None:
    file = tmp_path / "arm.csv"
    emulator = Emulator(EmulatorOptions(), watch=MotionLog(file))
    line = emulator.connect(29999)
    motion = emulator.connect(30003)
    assert line is not None
    assert motion is not None
    line.feed(b"EnableRobot()")
    motion.feed(b"JointMovJ(10,0,-90,0,90,0)")
    emulator.advance_to(0.4)
    Emulator(EmulatorOptions(), start=1.0, watch=MotionLog(file)).advance_to(1.08)
    rows = np.genfromtxt(file, delimiter=",", names=True)
    assert len(rows) == 60
    np.testing.assert_allclose(np.diff(rows["time"][:50]), 0.008, atol=1e-6)
    first = rows[:50]
    assert first["q1"][-1] > 0.02, "it moves"
    np.testing.assert_allclose(np.diff(first["q1"]), 0.008 * first["qd1"][1:], atol=1e-6)
    assert rows["mode"][-1] == 4
