"""The emulated arm's own log of its motion: what it did, whatever anybody commanded.

A CSV file with one row for each of the controller's 8 ms: the time on the caller's clock [s], the
mode, the six joints [rad] and their speeds [rad/s].
"""

from __future__ import annotations

from pathlib import Path

from services.cr5_emulator.controller import Controller

HEAD = ",".join(["time", "mode", *(f"q{k}" for k in range(1, 7)), *(f"qd{k}" for k in range(1, 7))])


class MotionLog:
    """Writes rows; a line is whole in the file even when the process is killed after it."""

    def __init__(self, file: Path) -> None:
        """Args: file: Continued when it exists, as by an emulator that was started again."""
        self._file = file.open("a", buffering=1)
        if file.stat().st_size == 0:
            self._file.write(HEAD + "\n")

    def __call__(self, now: float, controller: Controller) -> None:
        """One row. Args: now: [s]."""
        numbers = (*controller.joints, *controller.joint_speed)
        self._file.write(f"{now:.6f},{controller.mode}," + ",".join(f"{v:.7f}" for v in numbers))
        self._file.write("\n")
