"""`lariat run SCENARIO`: the closed loop in simulated time, scored by the true rope."""

from __future__ import annotations

import json as jsons
import tempfile
import time
from pathlib import Path
from typing import Annotated

import tyro
from rich.table import Table

from cli.terminal import Terminal
from lariat.configuration import ConfigurationError
from lariat.planning import preflight
from lariat.scenario import SIDES, Scenario
from lariat.scenario.plausibility import doubts
from lariat.scenario.settings import load_with
from lariat.trajectory import SECOND
from services.recorder.runs.run_folder import MAX_NOTE_LENGTH
from shared import topics
from shared.messages.parameters import described
from stack.simulation.closed_loop import run, with_emulated_arms
from stack.simulation.kept_run import KeptRun
from stack.simulation.score import Score, as_json
from stack.simulation.simulated_time import START, SimulatedStack


def main(
    scenario: tyro.conf.Positional[Path],
    /,
    record: Path | None = None,
    json: bool = False,
    stop_when_reached: bool = False,
    seed: int | None = None,
    list_in: Path | None = None,
    note: str = "",
    set: Annotated[
        tyro.conf.UseAppendAction[tuple[str, ...]], tyro.conf.arg(metavar="KEY=VALUE")
    ] = (),
) -> int:
    """Run a scenario in simulated time, headless and as fast as the machine allows.

    Examples:
      lariat run three-cylinders
      lariat run three-cylinders --set sensing.source=truth --json
      lariat run three-cylinders --record run.mcap --stop-when-reached
      lariat run three-cylinders --seed 3 --list-in recordings --note "third seed"

    Args:
        scenario: The scenario's TOML file, or the short name of a shipped one.
        record: Record all messages to this MCAP file, which must not exist.
        json: Answer with one JSON object on standard output.
        stop_when_reached: End as soon as the controller says that the goal is reached.
        seed: Replaces the scenario's seed.
        list_in: Folder of recordings that lists the run, as the page shows it.
        note: Note of the run in that list.
        set: Replaces one value of the scenario, e.g. sensing.source=truth; may be repeated.

    Returns:
        0 when the goal was reached, 1 when not.
    """
    loaded = load_with(scenario, set, seed)
    real = {s: loaded.end(s).address for s in SIDES if loaded.end(s).address}
    loaded = with_emulated_arms(loaded)
    if record and record.exists():
        raise ConfigurationError(f"--record {record}: the file exists; name another or remove it")
    if record:
        _check_writable(record)
    messages = Terminal(stderr=True)
    for side, address in real.items():
        messages.print(f"{side} arm: emulated, in the place of the one at {address}")
    for line in doubts(loaded):
        messages.print(f"plausible only by mistake: {line}")
    if len(note) > MAX_NOTE_LENGTH:
        raise ConfigurationError(
            f"--note has {len(note)} characters; it takes up to {MAX_NOTE_LENGTH}"
        )
    kept = KeptRun(loaded, list_in, record, note) if list_in else None
    return run_scenario(loaded, record, json, 0.0 if stop_when_reached else None, kept)


def run_scenario(
    scenario: Scenario,
    record: Path | None,
    json: bool,
    stop_after: float | None = None,
    kept: KeptRun | None = None,
) -> int:
    """Check and run a scenario in simulated time, and print its score; return the exit code."""
    messages = Terminal(stderr=True)
    preflight.check(scenario)
    try:
        taps = (kept,) if kept else ()
        start = _start(wall_clock=bool(record or kept))
        outcome = run(scenario, record, stop_after, progress=True, taps=taps, start=start)
    except OSError as error:
        raise ConfigurationError(f"--record {record}: {error}") from error
    if kept:
        try:
            kept.keep()
        except OSError as error:
            raise ConfigurationError(f"--list-in: {error}") from error
    if json:
        print(jsons.dumps(as_json(outcome.score)))
    else:
        Terminal().print(score_table(outcome.score))
    if not outcome.score.reached:
        messages.print(f"Not reached: {outcome.reason}.{_hold_note(outcome.stack)}")
    return 0 if outcome.score.reached else 1


def _start(wall_clock: bool) -> int:
    """Return the start of simulated time [ns]: that of the wall clock, where the run is kept."""
    return time.time_ns() // SECOND * SECOND if wall_clock else START


def _check_writable(record: Path) -> None:
    """Check before the run that its recording can be written."""
    try:
        record.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=record.parent):
            pass
    except OSError as error:
        raise ConfigurationError(f"--record {record}: {error}") from error


def score_table(score: Score) -> Table:
    """Return the table of a score."""
    table = Table(title=score.scenario, show_header=False, title_justify="left")
    verdict = f"after {score.reached_s} s" if score.reached else "no"
    rows = {
        "reached": verdict,
        "final error": _unit(score.final_error_mm, "mm (mean of the nodes)"),
        "largest node error": _unit(score.max_node_error_mm, "mm"),
        "angle of the ends": _unit(score.final_angle_rad, "rad", 4),
        "error of the shape": _unit(score.final_shape_error_mm, "mm (mean distance of the curves)"),
        "least clearance": _unit(score.min_clearance_mm, "mm"),
        "of its path, with 99 %": _unit(score.certain_clearance_mm, "mm"),
        "from distractors": _unit(score.min_distractor_clearance_mm, "mm"),
        "time in contact": _unit(score.contact_time_s, "s"),
        "length error": _unit(score.length_error_mm, "mm"),
        "prediction error": _unit(score.prediction_error_mm, "mm"),
        "horizon error": _unit(score.horizon_error_mm, "mm"),
        "sensing error": _unit(score.sensing_error_mm, "mm"),
        "replans": str(score.replans),
        "simulated": f"{score.sim_s} s in {score.wall_s} s ({score.real_time_factor} x real time)",
    }
    if score.plan_ms["max"]:
        rows["control step"] = "p50 {p50}, p99 {p99}, max {max} ms".format(**score.plan_ms)
    # What was given, not estimated, stands in the answer of --json.
    for name, (value, deviation) in score.parameters.items():
        if deviation:
            words, unit = described(name)
            rows[words] = f"{value:.4g} ± {deviation:.2g} {unit}".removesuffix(" -")
    if score.recording:
        rows["recording"] = score.recording
    for name, value in rows.items():
        if value != "-":
            table.add_row(name, value)
    return table


def _unit(value: float | None, unit: str, digits: int = 2) -> str:
    return "-" if value is None else f"{value:.{digits}f} {unit}"


def _hold_note(stack: SimulatedStack) -> str:
    arms = stack.latest(topics.ARM_STATE)
    if arms and arms.needs_acknowledgement:
        return f" The arms hold: {arms.reason}."
    return ""
