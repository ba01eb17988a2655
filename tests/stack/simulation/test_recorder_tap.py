"""Recording of a run in simulated time, as that of a live one."""

from __future__ import annotations

import logging
from pathlib import Path

from lariat.trajectory import SECOND
from shared.recording import Recording
from stack.simulation import closed_loop
from tests.stack import small_cell

START = 1_800_000_000 * SECOND


class Talker(small_cell.Rope):
    """Rope that logs a line with each step."""

    def step(self, inbox, now):
        logging.getLogger("services.sim.service").info("step at %d", now)
        yield from super().step(inbox, now)


def record(folder: Path, start: int):
    scenario = small_cell.scenario(folder)
    rope, *others = small_cell.members(scenario)
    path = folder / f"{start}.mcap"
    members = (Talker(rope.count), *others)
    outcome = closed_loop.run(scenario, path, stop_after=0.0, members=members, start=start)
    return outcome, list(Recording(path).messages())


def test_what_the_services_log_is_recorded_at_its_simulated_time(tmp_path: Path):
    _, entries = record(tmp_path, START)
    lines = [entry.parse() for entry in entries if entry.key == "log/sim"]
    assert len(lines) > 30
    assert lines[3].message == f"step at {lines[3].timestamp.ToNanoseconds()}"
    assert lines[0].name == "sim"
    assert not logging.getLogger("services").handlers


def test_a_run_that_starts_by_the_wall_clock_is_the_same_run(tmp_path: Path):
    (early, first), (late, second) = record(tmp_path, SECOND), record(tmp_path, START)
    assert early.score.final_error_mm == late.score.final_error_mm
    assert early.score.reached_s == late.score.reached_s
    assert [(e.key, e.sequence, e.log_time - SECOND) for e in first] == [
        (e.key, e.sequence, e.log_time - START) for e in second
    ]


def test_log_time_is_the_receipt_and_publish_time_the_step(tmp_path: Path):
    _, entries = record(tmp_path, START)
    latency = {e.log_time - e.publish_time for e in entries if e.key == "rope/truth"}
    assert latency == {round(small_cell.Rope.latency * SECOND)}
