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
    """Number of threads."""
    processor_s: float
    """Processor time that the process has used since it began [s]."""
    step_p99_ms: float = 0.0
    """99th percentile of the step times of the last second [ms]; 0 where there are no steps."""
    period_ms: float = 0.0
    """Period of the steps [ms]; 0 where there are no steps."""


@dataclass(frozen=True)
class Trend:
    """Change of a process over an operation, without its first tenth, which warms up."""

    process: str
    """Name of the process."""
    samples: int
    """Number of samples."""
    memory_mb: tuple[float, float]
    """Resident memory at the first and at the last sample [MB]."""
    memory_mb_per_hour: float
    """Slope of a line through the memory [MB/h]."""
    files: tuple[int, int]
    """Fewest and most open files."""
    threads: tuple[int, int]
    """Fewest and most threads."""
    processor_percent: float
    """Processor time between the first and the last sample, as a share of one core [%]."""
    step_p99_ms: tuple[float, float]
    """Median of the 99th percentiles of the step times in the first and in the last half [ms]."""
    period_ms: float
    """Period of the steps [ms]; 0 where there are no steps."""


def sample_of(
    process: str,
    pid: int | None,
    minutes: float,
    step_p99_ms: float = 0.0,
    period_ms: float = 0.0,
) -> Sample:
    """Return a sample of a running process.

    Args:
        process: Name of the process.
        pid: Its id; None: this process.
        minutes: Time of operation so far [min].
        step_p99_ms: 99th percentile of its step times [ms].
        period_ms: Period of its steps [ms].

    Raises:
        psutil.NoSuchProcess: There is no such process.
    """
    found = psutil.Process(pid)
    times = found.cpu_times()
    return Sample(
        process=process,
        minutes=round(minutes, 3),
        memory_mb=round(found.memory_info().rss / 2**20, 2),
        files=found.num_fds(),
        threads=found.num_threads(),
        processor_s=round(times.user + times.system, 2),
        step_p99_ms=round(step_p99_ms, 3),
        period_ms=round(period_ms, 3),
    )


def trends(samples: Sequence[Sample]) -> list[Trend]:
    """Return the trend of each process, in the order of their first samples."""
    names = list(dict.fromkeys(sample.process for sample in samples))
    return [_trend([s for s in samples if s.process == name]) for name in names]


def _trend(samples: Sequence[Sample]) -> Trend:
    rows = list(samples)[len(samples) // 10 :]
    hours = np.array([row.minutes for row in rows]) / 60.0
    memory = np.array([row.memory_mb for row in rows])
    slope = np.polyfit(hours, memory, 1)[0] if np.ptp(hours) > 0.0 else 0.0
    steps = [row.step_p99_ms for row in rows]
    half = max(len(rows) // 2, 1)
    seconds = 60.0 * (rows[-1].minutes - rows[0].minutes)
    used = rows[-1].processor_s - rows[0].processor_s
    return Trend(
        process=rows[0].process,
        samples=len(rows),
        memory_mb=(rows[0].memory_mb, rows[-1].memory_mb),
        memory_mb_per_hour=round(float(slope), 2),
        files=(min(r.files for r in rows), max(r.files for r in rows)),
        threads=(min(r.threads for r in rows), max(r.threads for r in rows)),
        processor_percent=round(100.0 * used / seconds, 1) if seconds > 0.0 else 0.0,
        step_p99_ms=(
            round(float(np.median(steps[:half])), 2),
            round(float(np.median(steps[-half:])), 2),
        ),
        period_ms=rows[-1].period_ms,
    )
