"""Samples of a process over a long operation, and their trend."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import psutil


@dataclass(frozen=True)
class Sample:
    """State of one process at one time."""

    process: str
    """Name of the process."""
    minutes: float
    """Time of operation so far [min]."""
    memory_mb: float
    """Resident memory [MB]."""
    files: int
    """Number of open files and sockets."""
    threads: int
    processor_s: float
    """Processor time that the process has used since it began [s]."""
    step_p99_ms: float = 0.0
    """99th percentile of the step times of the last second [ms]; 0 where there are no steps."""
    period_ms: float = 0.0
    """Period of the steps [ms]; 0 where there are no steps."""


def sample_of(process: str, pid: int | None, minutes: float, *steps: float) -> Sample:
    """Return a sample of a running process; of this one where its id is None.

    Raises:
        psutil.NoSuchProcess: There is no such process.
    """
    running = psutil.Process(pid)
    times, memory = running.cpu_times(), running.memory_info().rss / 2**20
    used = times.user + times.system
    return Sample(process, minutes, memory, running.num_fds(), running.num_threads(), used, *steps)


def trends(samples: Sequence[Sample]) -> list[dict[str, object]]:
    """Return the change of each process, without its first tenth, which warms up.

    Step times are medians of the first and of the last half.
    """
    names = dict.fromkeys(sample.process for sample in samples)
    return [_trend([s for s in samples if s.process == name]) for name in names]


def _trend(samples: Sequence[Sample]) -> dict[str, object]:
    rows = samples[len(samples) // 10 :]
    first, last = rows[0], rows[-1]
    hours = np.array([row.minutes for row in rows]) / 60.0
    slope = np.polyfit(hours, [row.memory_mb for row in rows], 1)[0] if np.ptp(hours) > 0.0 else 0.0
    steps = [row.step_p99_ms for row in rows]
    half = max(len(rows) // 2, 1)
    seconds = 60.0 * (last.minutes - first.minutes)
    used = last.processor_s - first.processor_s
    return {
        "process": first.process,
        "samples": len(rows),
        "memory_mb": (round(first.memory_mb, 1), round(last.memory_mb, 1)),
        "memory_mb_per_hour": round(float(slope), 2),
        "files": (min(r.files for r in rows), max(r.files for r in rows)),
        "threads": (min(r.threads for r in rows), max(r.threads for r in rows)),
        "processor_percent": round(100.0 * used / seconds, 1) if seconds > 0.0 else 0.0,
        "step_p99_ms": [round(float(np.median(s)), 2) for s in (steps[:half], steps[-half:])],
        "period_ms": round(last.period_ms, 3),
    }
