"""Step times of the live stack, and its way from camera to arm: `lariat bench speed live FILE`.

Every service publishes statistics of its step times once a second. The figures are medians of these
over the recording, so that a warm-up or a single late step does not dominate; the maximum is that
of all steps.
"""

from __future__ import annotations

import tempfile
from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
import tyro

from benchmarks.conditions import Conditions
from benchmarks.result_block import report
from benchmarks.speed.camera_to_arm import latencies
from lariat.configuration import ConfigurationError
from lariat.trajectory import SECOND
from shared import topics
from shared.messages import ArmStates, Health
from shared.recording import Recording

RECORDING_FOLDER = Path("recordings")
"""Folder of the recordings of `lariat up`."""
MOTION_WINDOW = SECOND // 8
"""Resolution at which motion of the arms is noted [ns]."""


@dataclass(frozen=True)
class StepTimes:
    """Step times of one service over a recording."""

    service: str
    """Name of the service."""
    seconds: int
    """Number of seconds with statistics."""
    period_ms: float
    """Period of the steps [ms]."""
    p50_ms: float
    """Median over the seconds of their median step time [ms]."""
    p50_moving_ms: float | None
    """Median over the seconds in which an arm moved [ms]; None if none did."""
    p99_ms: float
    """Median over the seconds of their 99th percentile [ms]."""
    max_ms: float
    """Longest step [ms]."""
    overruns: float
    """Share of the steps that took longer than the period [-]."""
    drops: int
    """Number of inputs that were overwritten before a step read them."""


def run(
    file: Annotated[Path | None, tyro.conf.Positional] = None,
    /,
    json: bool = False,
) -> int:
    """Print the step times and the latency of a live run, from its recording.

    The caption names plant, sensing and adaptation of the recorded scenario. Latency is the time
    from the exposure of an image until a process publishes what rests on it.

    Examples:
      lariat bench speed live
      lariat bench speed live recordings/2026-01-31_12-00-00_three-cylinders.mcap

    Args:
        file: Recording of `lariat up`; by default the newest one in recordings/.
        json: Print two JSON objects instead of tables: step times, and latencies.
    """
    path = file or _newest()
    try:
        recording = Recording.open(path)
        rows = step_times(recording)
        delays = latencies([recording])
    except ValueError as error:
        raise ConfigurationError(str(error)) from error
    if not rows:
        raise ConfigurationError(f"{path} holds no health; name a recording of `lariat up`")
    with tempfile.TemporaryDirectory() as folder:
        conditions = Conditions.of(recording.scenario(Path(folder)).live)
    report(rows, str(conditions), title=str(path), json=json)
    report(delays, "from the exposure of an image", json=json)
    return 0


def step_times(recording: Recording) -> list[StepTimes]:
    """Step times of every service, in alphabetical order."""
    moving: set[int] = set()
    healths: dict[str, list[tuple[int, Health]]] = defaultdict(list)
    for entry in recording.messages():
        if entry.key.startswith("health/"):
            health = entry.parse()
            healths[health.service].append((entry.log_time, health))
        elif entry.key == topics.ARM_STATE.key and entry.parse().mode == ArmStates.MOVING:
            moving.add(entry.log_time // MOTION_WINDOW)
    return [_service_times(name, rows, moving) for name, rows in sorted(healths.items())]


def _service_times(name: str, rows: list[tuple[int, Health]], moving: set[int]) -> StepTimes:
    # The first message covers no second: it is sent as soon as the service is ready.
    reports = [(at, h) for at, h in rows if h.step_max_ms > 0.0]
    busy = [h.step_p50_ms for at, h in reports if _is_moving(at, moving)]
    first, last = rows[0][1], rows[-1][1]
    steps = max(last.steps - first.steps, 1)
    return StepTimes(
        service=name,
        seconds=len(reports),
        period_ms=round(last.period_ms, 3),
        p50_ms=_median([h.step_p50_ms for _, h in reports]),
        p50_moving_ms=_median(busy) if busy else None,
        p99_ms=_median([h.step_p99_ms for _, h in reports]),
        max_ms=round(max((h.step_max_ms for _, h in reports), default=0.0), 3),
        overruns=round((last.overruns - first.overruns) / steps, 4),
        drops=last.drops - first.drops,
    )


def _is_moving(at: int, moving: set[int]) -> bool:
    """Whether an arm moved in most of the second before a time [ns]."""
    end = at // MOTION_WINDOW
    return sum(k in moving for k in range(end - 8, end)) >= 4


def _median(values: list[float]) -> float:
    return round(float(np.median(values)), 3) if values else 0.0


def _newest() -> Path:
    files = [p for p in RECORDING_FOLDER.glob("*.mcap") if not p.name.endswith("_idle.mcap")]
    files.sort(key=lambda path: path.stat().st_mtime)
    if not files:
        raise ConfigurationError(f"there is no recording in {RECORDING_FOLDER}/; name a file")
    return files[-1]
