"""Log of the emulated arm's joint motion, independent of what was commanded.

A CSV file with one row per 8 ms step of the controller: time on the caller's clock [s], mode, six
joint angles [rad] and six joint speeds [rad/s].
"""

from __future__ import annotations

from pathlib import Path

from services.cr5_emulator.controller import Controller

LOG_HEADER = ",".join(
    ["time", "mode", *(f"q{k}" for k in range(1, 7)), *(f"qd{k}" for k in range(1, 7))]
)


class MotionLog:
    """Line-buffered writer: a row is complete in the file even if the process is killed."""

    def __init__(self, file: Path) -> None:
        """Args: file: Appended to when it exists, as after a restart of the emulator."""
        self._file = file.open("a", buffering=1)
        if file.stat().st_size == 0:
            self._file.write(LOG_HEADER + "\n")

    def __call__(self, now: float, controller: Controller) -> None:
        """Append one row. Args: now: Time on the caller's clock [s]."""
        numbers = (*controller.joints, *controller.joint_speed)
        self._file.write(f"{now:.6f},{controller.mode}," + ",".join(f"{v:.7f}" for v in numbers))
        self._file.write("\n")
