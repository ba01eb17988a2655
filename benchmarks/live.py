"""How the live stack kept its pace, from the health in a recorded run: `lariat bench live FILE`.

Every service says once a second how long its steps took. A row here is the median of these over the
seconds of the recording, so that a warm-up or one late step does not make a whole run look slow;
the worst step is the worst.
"""

from __future__ import annotations

import json as encoder
import sys
from collections import defaultdict
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
import tyro

from shared import topics
from shared.configuration import ConfigurationError
from shared.messages import ArmStates, Health
from shared.recording import Recording
from shared.service import SECOND

FOLDER = Path("recordings")


@dataclass(frozen=True)
class Pace:
    """One service over a recording; times in ms."""

    service: str
    seconds: int
    """In which it said how it fared."""
    period_ms: float
    p50_ms: float
    p50_moving_ms: float | None
    """In the seconds in which an arm moved; None when none did."""
    p99_ms: float
    max_ms: float
    late: float
    """Share of the steps that lasted longer than the period."""
    unread: int
    """Inputs that were overwritten before a step could read them."""


def run(file: Annotated[Path | None, tyro.conf.Positional] = None, /, json: bool = False) -> int:
    """Reads the step times of a live run from its recording.

    Examples:
      lariat bench live
      lariat bench live recordings/2026-01-31_12-00-00_three-cylinders.mcap

    Args:
        file: A recording of `lariat up`; the newest in recordings/ without.
        json: One JSON object instead of a table.
    """
    path = file or _newest()
    try:
        rows = paces(Recording.open(path))
    except ValueError as error:
        raise ConfigurationError(str(error)) from error
    if not rows:
        print(f"{path} holds no health: it is no recording of a live stack", file=sys.stderr)
        return 1
    if json:
        print(encoder.dumps({"recording": str(path), "services": [asdict(r) for r in rows]}))
    else:
        _print(path, rows)
    return 0


def paces(recording: Recording) -> list[Pace]:
    """One row for every service, in the order of the alphabet."""
    moving: set[int] = set()
    healths: dict[str, list[tuple[int, Health]]] = defaultdict(list)
    for entry in recording.messages():
        if entry.key.startswith("health/"):
            health = entry.parse()
            healths[health.service].append((entry.log_time, health))
        elif entry.key == topics.ARM_STATE.key and entry.parse().mode == ArmStates.MOVING:
            moving.add(entry.log_time // (SECOND // 8))
    return [_pace(name, rows, moving) for name, rows in sorted(healths.items())]


def _pace(name: str, rows: list[tuple[int, Health]], moving: set[int]) -> Pace:
    # The first one tells of no second: it comes as soon as the service is ready.
    told = [(at, h) for at, h in rows if h.step_max_ms > 0.0]
    busy = [h.step_p50_ms for at, h in told if _moved(at, moving)]
    first, last = rows[0][1], rows[-1][1]
    steps = max(last.steps - first.steps, 1)
    return Pace(
        service=name,
        seconds=len(told),
        period_ms=round(last.period_ms, 3),
        p50_ms=_median([h.step_p50_ms for _, h in told]),
        p50_moving_ms=_median(busy) if busy else None,
        p99_ms=_median([h.step_p99_ms for _, h in told]),
        max_ms=round(max((h.step_max_ms for _, h in told), default=0.0), 3),
        late=round((last.overruns - first.overruns) / steps, 4),
        unread=last.drops - first.drops,
    )


def _moved(at: int, moving: set[int]) -> bool:
    """Whether an arm moved in most of the second before a time [ns]."""
    end = at // (SECOND // 8)
    return sum(k in moving for k in range(end - 8, end)) >= 4


def _median(values: list[float]) -> float:
    return round(float(np.median(values)), 3) if values else 0.0


def _newest() -> Path:
    files = sorted(FOLDER.glob("*.mcap"), key=lambda path: path.stat().st_mtime)
    if not files:
        raise ConfigurationError(f"there is no recording in {FOLDER}/; name one")
    return files[-1]


def _print(path: Path, rows: list[Pace]) -> None:
    from rich.console import Console
    from rich.table import Table

    table = Table(box=None, pad_edge=False, title=str(path), title_justify="left")
    table.add_column("service")
    for head in ("p50 ms", "moving ms", "p99 ms", "max ms", "period ms", "late %", "unread", "s"):
        table.add_column(head, justify="right")
    for r in rows:
        table.add_row(
            r.service,
            f"{r.p50_ms:.1f}",
            "–" if r.p50_moving_ms is None else f"{r.p50_moving_ms:.1f}",
            f"{r.p99_ms:.1f}",
            f"{r.max_ms:.1f}",
            f"{r.period_ms:.1f}",
            f"{100.0 * r.late:.1f}",
            str(r.unread),
            str(r.seconds),
        )
    Console(file=sys.stdout, width=120).print(table)
