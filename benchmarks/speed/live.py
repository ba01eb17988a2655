"""Step times of the live stack, and its way from camera to arm: `lariat bench speed live FILE`.

Every service publishes statistics of its step times once a second. The figures are medians of these
over the recording, so that a warm-up or a single late step does not dominate; the maximum is that
of all steps. Latency: every message carries the stamp of the image that it rests on, or the number
of the setpoints that it answers, and recordings hold the time at which each was published. So one
image is followed through camera, perception, controller and gateway.
"""

from __future__ import annotations

import tempfile
from collections import defaultdict
from collections.abc import Iterable
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import tyro

from benchmarks.conditions import Conditions
from benchmarks.tables import PRINT_DEFAULTS, Flat, PrintOptions, Result
from lariat.configuration import ConfigurationError
from lariat.scenario.cameras import DEFAULT_CAMERA
from lariat.trajectory import SECOND
from shared import topics
from shared.messages import ArmStates, Health, stamp_of
from shared.recording import Recording

RECORDING_FOLDER = Path("recordings")
"""Folder of the recordings of `lariat up`."""
MOTION_WINDOW = SECOND // 8
"""Resolution at which motion of the arms is noted [ns]."""
COLOR, DEPTH = (t.at(DEFAULT_CAMERA) for t in (topics.CAMERA_COLOR, topics.CAMERA_DEPTH))
STAGES = ("image published", "rope published", "setpoints published", "setpoints accepted")
"""Stages on the way of an image, in their order; each is reached when a process publishes."""


def run(
    file: Annotated[Path | None, tyro.conf.Positional] = None,
    /,
    options: Flat[PrintOptions] = PRINT_DEFAULTS,
) -> int:
    """Print the step times and the latency of a live run, from its recording.

    The caption names plant, sensing and adaptation of the recorded scenario. Latency is the time
    from the exposure of an image until a process publishes what rests on it.

    Examples:
      lariat bench speed live
      lariat bench speed live recordings/2026-01-31_12-00-00_three-cylinders.mcap

    Args:
        file: Recording of `lariat up`; by default the newest one in recordings/.
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
        conditions = f"{path}; {Conditions.of(recording.scenario(Path(folder)).live)}"
    latency = Result("latencies", delays, "from the exposure of an image")
    options.publish(Result("steps", rows, conditions), latency)
    return 0


def step_times(recording: Recording) -> list[dict[str, Any]]:
    """Return the step times of every service over a recording, in alphabetical order."""
    moving: set[int] = set()
    healths: dict[str, list[tuple[int, Health]]] = defaultdict(list)
    for entry in recording.messages():
        if entry.key.startswith("health/"):
            health = entry.parse()
            healths[health.service].append((entry.log_time, health))
        elif entry.key == topics.ARM_STATE.key and entry.parse().mode == ArmStates.MOVING:
            moving.add(entry.log_time // MOTION_WINDOW)
    return [_service_times(name, rows, moving) for name, rows in sorted(healths.items())]


def _service_times(name: str, rows: list[tuple[int, Health]], moving: set[int]) -> dict[str, Any]:
    # The first message covers no second: it is sent as soon as the service is ready.
    reports = [(at, h) for at, h in rows if h.step_max_ms > 0.0]
    busy = [h.step_p50_ms for at, h in reports if _is_moving(at, moving)]
    first, last = rows[0][1], rows[-1][1]
    overruns = (last.overruns - first.overruns) / max(last.steps - first.steps, 1)
    return {
        "service": name,
        "seconds": len(reports),
        "period_ms": round(last.period_ms, 3),
        "p50_ms": _median([h.step_p50_ms for _, h in reports]),
        "p50_moving_ms": _median(busy) if busy else None,
        "p99_ms": _median([h.step_p99_ms for _, h in reports]),
        "max_ms": round(max((h.step_max_ms for _, h in reports), default=0.0), 3),
        "overruns": round(overruns, 4),
        "drops": last.drops - first.drops,
    }


def _is_moving(at: int, moving: set[int]) -> bool:
    """Whether an arm moved in most of the second before a time [ns]."""
    end = at // MOTION_WINDOW
    return sum(k in moving for k in range(end - 8, end)) >= 4


def _median(values: list[float]) -> float:
    return round(float(np.median(values)), 3) if values else 0.0


def _newest() -> Path:
    files = [p for p in RECORDING_FOLDER.glob("*.mcap") if not p.name.endswith("_idle.mcap")]
    if not files:
        raise ConfigurationError(f"there is no recording in {RECORDING_FOLDER}/; name a file")
    return max(files, key=lambda path: path.stat().st_mtime)


def latencies(recordings: Iterable[Recording]) -> list[dict[str, Any]]:
    """Return the latency of each stage that an image of the recordings has reached."""
    delays: dict[str, list[float]] = {stage: [] for stage in STAGES}
    for recording in recordings:
        for stage, times in _reached(recording).items():
            delays[stage] += [1e-6 * (sent - exposed) for exposed, sent in times.items()]
    rows: list[dict[str, Any]] = []
    for stage, values in ((stage, values) for stage, values in delays.items() if values):
        p50, p99 = np.quantile(values, [0.5, 0.99]).round(3).tolist()
        rows.append({"stage": stage, "images": len(values), "p50_ms": p50, "p99_ms": p99})
    return rows


def _reached(recording: Recording) -> dict[str, dict[int, int]]:
    """For each stage, when an image reached it [ns], by the time of its exposure [ns]."""
    reached: dict[str, dict[int, int]] = {stage: {} for stage in STAGES}
    # Setpoints whose acceptance is still to come: image by session and number.
    waiting: dict[tuple[str, int], int] = {}
    image, rope, setpoints, accepted = (reached[stage] for stage in STAGES)
    for entry in recording.messages():
        sent = entry.publish_time
        match entry.key:
            case COLOR.key | DEPTH.key:
                stamp = stamp_of(entry.parse())
                image[stamp] = max(image.get(stamp, sent), sent)
            case topics.ROPE_NODES.key:
                rope.setdefault(stamp_of(entry.parse()), sent)
            case topics.ARM_SETPOINTS.key:
                message = entry.parse()
                if message.image_stamp and message.image_stamp not in setpoints:
                    setpoints[message.image_stamp] = sent
                    waiting[message.session, message.sequence] = message.image_stamp
            case topics.ARM_STATE.key:
                message = entry.parse()
                for session, sequence in list(waiting):
                    if session == message.session and sequence <= message.sequence:
                        accepted[waiting.pop((session, sequence))] = sent
    return reached
