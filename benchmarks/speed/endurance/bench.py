"""Long operation, simulated or live: `lariat bench speed endurance`."""

from __future__ import annotations

import json as encoder
import logging
import sys
from dataclasses import asdict
from pathlib import Path
from typing import Any

from rich.markup import escape
from rich.table import Table

from benchmarks.conditions import Conditions
from benchmarks.result_block import find_block, show
from benchmarks.speed.camera_to_arm import Latency, latency_table
from benchmarks.speed.endurance.live import LiveOperation
from benchmarks.speed.endurance.samples import Sample, Trend, trends
from benchmarks.speed.endurance.simulated import SimulatedOperation
from lariat.configuration import ConfigurationError
from lariat.scenario import Scenario, load
from lariat.scenario.shipped import find

DEFAULT_SCENARIO = find("three-cylinders")
"""Scenario of the runs."""


def run(
    hours: float = 1.0,
    live_minutes: float = 0.0,
    pages: int = 20,
    hostile_rate: float = 0.0,
    scenario: Path = DEFAULT_SCENARIO,
    progress: Path | None = None,
    docs: Path | None = None,
    json: bool = False,
) -> int:
    """Run back to back for hours, and show whether memory, files, threads or step times grow.

    Simulated: all services in one process, true nodes sensed, a reset after every run. Live:
    `lariat up` with dashboard and recorder, pages open all the time. Its recordings go to a
    temporary folder; the last of them tell how long camera images take to the arms.

    Examples:
      lariat bench speed endurance --hours 8 --progress endurance.json
      lariat bench speed endurance --hours 0 --live-minutes 30 --pages 20
      lariat bench speed endurance --hours 0 --live-minutes 5 --pages 0 --hostile-rate 1000

    Args:
        hours: Simulated time of operation [h].
        live_minutes: Time of live operation [min].
        pages: Number of pages that are open during it.
        hostile_rate: Hostile messages over all topics in a second of it, which the check of the bus
            refuses [Hz].
        scenario: Scenario of the runs.
        progress: File of the samples so far; an interrupted simulated operation goes on from it,
            in a new process.
        docs: Folder of pages, in which the block of this command is written; none by default.
        json: Print one JSON object instead of tables.

    Returns:
        0 when every run reached its goal, 1 otherwise.
    """
    block = find_block(docs)
    loaded = load(scenario)
    # What this process refuses beside the services is no news.
    logging.disable(logging.WARNING)
    answers: dict[str, Any] = {}
    if hours > 0.0:
        answers["simulated"] = _simulated(loaded, 60.0 * hours, progress)
    if live_minutes > 0.0:
        answers["live"] = _live(scenario, live_minutes, pages, hostile_rate)
    logging.disable(logging.NOTSET)
    if json:
        print(encoder.dumps(answers))
    else:
        conditions = {"simulated": Conditions.of(loaded), "live": Conditions.of(loaded.live)}
        found = [
            table for answer in answers.items() for table in _tables(*answer, conditions[answer[0]])
        ]
        show(found, block, 120)
    return 1 if any(answer["failures"] for answer in answers.values()) else 0


def _simulated(scenario: Scenario, minutes: float, progress: Path | None) -> dict[str, Any]:
    known = _read(progress)
    samples = [Sample(**row) for row in known["samples"]]
    before = max((sample.minutes for sample in samples), default=0.0)
    runs, failures = known["runs"], known["failures"]
    if before < minutes:
        operation = SimulatedOperation(scenario)
        for new in operation.run_until(minutes, before):
            samples += new
            _report(new[-1], operation.runs + runs)
            _write(progress, samples, runs + operation.runs, failures + operation.failures)
        runs, failures = runs + operation.runs, failures + operation.failures
    return _answer(samples, runs, failures)


def _live(scenario: Path, minutes: float, pages: int, hostile_rate: float) -> dict[str, Any]:
    with LiveOperation(scenario, pages, hostile_rate) as operation:
        samples: list[Sample] = []
        for new in operation.run_until(minutes):
            samples += new
            _report(new[-1], operation.runs)
        answer = _answer(samples, operation.runs, operation.failures)
        return {
            **answer,
            "holds": operation.holds,
            "refused": operation.refused,
            "ended_pages": operation.ended_pages,
            "latency": [asdict(latency) for latency in operation.latencies()],
        }


def _answer(samples: list[Sample], runs: int, failures: list[str]) -> dict[str, Any]:
    return {
        "minutes": max((sample.minutes for sample in samples), default=0.0),
        "runs": runs,
        "failures": failures,
        "trends": [asdict(trend) for trend in trends(samples)],
    }


def _read(progress: Path | None) -> dict[str, Any]:
    if progress is None or not progress.exists():
        return {"samples": [], "runs": 0, "failures": []}
    try:
        known = encoder.loads(progress.read_text(encoding="utf-8"))
        return {key: known[key] for key in ("samples", "runs", "failures")}
    except (OSError, KeyError, TypeError, encoder.JSONDecodeError) as error:
        raise ConfigurationError(f"cannot read {progress}: {error}; remove it") from error


def _write(progress: Path | None, samples: list[Sample], runs: int, failures: list[str]) -> None:
    if progress is None:
        return
    rows = [asdict(sample) for sample in samples]
    new = progress.with_suffix(".new")
    new.write_text(encoder.dumps({"samples": rows, "runs": runs, "failures": failures}))
    new.replace(progress)


def _report(sample: Sample, runs: int) -> None:
    line = f"{sample.minutes:.1f} min, {runs} runs reached, {sample.memory_mb:.0f} MB"
    print(line, file=sys.stderr, flush=True)


def _tables(name: str, answer: dict[str, Any], conditions: Conditions) -> list[Table]:
    live = name == "live"
    title = f"{name}: {answer['minutes']:.0f} min, {answer['runs']} runs reached"
    notes = [str(conditions) if live else "true nodes sensed"]
    if live:
        notes.append(f"{len(answer['holds'])} holds, {answer['refused']} messages refused")
        notes += answer["holds"][:10]
        notes += [answer["ended_pages"]] if answer["ended_pages"] else []
    notes += answer["failures"][:10]
    table = Table(box=None, title=title, caption=escape("; ".join(notes)), title_justify="left")
    heads = ["samples", "memory MB", "MB/h", "files", "threads", "step p99 ms"]
    table.add_column("process")
    for head in [*heads, "period ms", "core %"] if live else heads:
        table.add_column(head, justify="right")
    found = [Trend(**row) for row in answer["trends"]]
    for trend in found:
        cells = [
            str(trend.samples),
            " → ".join(f"{value:.0f}" for value in trend.memory_mb),
            f"{trend.memory_mb_per_hour:+.1f}",
            "–".join(map(str, trend.files)),
            "–".join(map(str, trend.threads)),
            " → ".join(f"{value:.1f}" for value in trend.step_p99_ms),
        ]
        if live:
            cells += [f"{trend.period_ms:.1f}", f"{trend.processor_percent:.1f}"]
        table.add_row(trend.process, *cells)
    if live:
        total = sum(trend.processor_percent for trend in found)
        table.add_row("all", *[""] * len(heads), "", f"{total:.1f}")
    latency = [Latency(**row) for row in answer.get("latency", [])]
    return [table, latency_table(latency)] if latency else [table]
