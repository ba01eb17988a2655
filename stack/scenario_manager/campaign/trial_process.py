"""Process of one trial: `lariat run` at the lowest priority, and the score that it prints."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from lariat.files.bounded_file import read_file
from shared.messages import CampaignTrial
from stack.launcher.library_environment import LIBRARY_ENVIRONMENT
from stack.launcher.process import child_command

NICENESS = 19
"""Scheduling priority, nice(2): whatever the live cell needs comes first."""
MAX_OUTPUT_SIZE = 2**20
"""Largest output of a trial that is read [bytes]."""
WIDE = {"COLUMNS": "500"}
"""Environment variable by which messages of a trial stay on one line."""
NOT_A_NUMBER = float("nan")


@dataclass(frozen=True)
class TrialOptions:
    """Trial to run."""

    scenario: Path
    """Scenario's file."""
    seed: int
    """Seed of the run."""
    stop_when_reached: bool
    """Whether the run ends as soon as its goal is reached."""
    note: str
    """Note of the run in the list of runs."""
    recording: str
    """File name of its recording; empty records nothing."""


Command = Callable[[TrialOptions], Sequence[str]]
"""Arguments of the Python interpreter that run a trial, which prints a score as
`lariat run --json` does."""


class TrialProcess:
    """Trial that goes on."""

    def __init__(self, command: Sequence[str], folder: Path) -> None:
        self._output, self._errors = folder / "score.json", folder / "errors.txt"
        self._began = time.monotonic()
        # Files and not pipes: a pipe that nobody reads stops the process that fills it.
        with self._output.open("wb") as output, self._errors.open("wb") as errors:
            self._process = subprocess.Popen(
                child_command(signal.SIGKILL, NICENESS, command),
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=errors,
                env={**os.environ, **LIBRARY_ENVIRONMENT, **WIDE},
                start_new_session=True,
            )

    def take_end(self, trial: CampaignTrial) -> bool:
        """Write the score of a process that has ended to its trial."""
        trial.wall = time.monotonic() - self._began
        if self._process.poll() is None:
            return False
        try:
            take_score(trial, json.loads(read_file(self._output, MAX_OUTPUT_SIZE)))
            trial.state = CampaignTrial.DONE
        except (OSError, ValueError, KeyError, TypeError):
            trial.state = CampaignTrial.BROKEN
        if not trial.reached:
            trial.reason = self._last_line() or f"exit code {self._process.returncode}"
        return True

    def kill(self) -> None:
        """End the process and all that it started."""
        if self._process.poll() is None:
            os.killpg(self._process.pid, signal.SIGKILL)
        self._process.wait()

    def _last_line(self) -> str:
        try:
            text = read_file(self._errors, MAX_OUTPUT_SIZE).decode(errors="replace")
        except (OSError, ValueError):
            return ""
        lines = [line.strip() for line in text.splitlines() if line.strip()]
        return lines[-1][:500] if lines else ""


def take_score(trial: CampaignTrial, score: dict[str, Any]) -> None:
    """Write a score, as `lariat run --json` prints it, to its trial."""
    reached_after = score["reached_s"]
    trial.reached = bool(score["reached"])
    trial.reached_after = NOT_A_NUMBER if reached_after is None else reached_after
    trial.error = _meters(score["final_error_mm"])
    trial.max_node_error = _meters(score["max_node_error_mm"])
    trial.min_clearance = _meters(score["min_clearance_mm"])
    trial.contact_time = score["contact_time_s"]
    trial.replans = score["replans"]


def _meters(millimeters: float | None) -> float:
    return NOT_A_NUMBER if millimeters is None else 1e-3 * millimeters
