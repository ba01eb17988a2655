"""`lariat replay FILE`: step services through their recorded inputs and compare their outputs."""

from __future__ import annotations

import json as jsons
import os
import tempfile
from collections import Counter
from collections.abc import Iterator
from itertools import chain
from pathlib import Path
from typing import Annotated, Any

import tyro
from google.protobuf.json_format import MessageToDict
from rich.table import Table

from cli.run import run_scenario, score_table
from cli.terminal import Terminal, progress_bar
from lariat.configuration import ConfigurationError, refusing
from lariat.scenario import Scenario
from lariat.scenario.extensions import require_allowed
from lariat.suggestion import did_you_mean
from lariat.trajectory import SECOND
from shared import topics
from shared.recording import Recording, Writer
from stack import services
from stack.replay.measures import RecordedMeasures, recorded_measures
from stack.replay.outside_inputs import NotReplayable, subject
from stack.replay.recorded_service import RecordedService
from stack.replay.resume import scenario_at
from stack.replay.trace_replay import ReplayResult, replay_start
from stack.simulation.score import as_json

LISTED_DIFFERENCES = 12
"""Number of differences that are listed for each start of a service."""
KINDS = {
    "extra": "one message more than recorded",
    "lacks": "not published",
    "doubled": "doubled in the recording",
    "absent": "input is not in the recording",
    "lost step": "trace is not in the recording",
}
"""How a difference that concerns a whole message is named."""


def main(
    file: tyro.conf.Positional[Path],
    /,
    service: Annotated[
        tyro.conf.UseAppendAction[tuple[str, ...]], tyro.conf.arg(metavar="NAME")
    ] = (),
    json: bool = False,
    update: bool = False,
    measures: bool = False,
    from_: Annotated[float | None, tyro.conf.arg(name="from", metavar="SECONDS")] = None,
    allow: Annotated[
        tyro.conf.UseAppendAction[tuple[str, ...]], tyro.conf.arg(metavar="NAME")
    ] = (),
) -> int:
    """Step services through the inputs that a recording holds, and compare their outputs with it.

    Each step must publish exactly the recorded messages, and each field must be as recorded, within
    the tolerance of its topic (shared/topics.py). An input that the recording lacks and a message
    that it holds twice are differences, too. The processor time of the steps is printed beside.

    With --measures, no service is stepped: the measures of `lariat run` are computed again from the
    recorded messages, by the true rope or, where it was not recorded, by the seen one.

    With --from, the loop is run on instead, in simulated time with this version's code: from rope,
    grips, goal and obstacles of that moment, the rope at rest. The answer is that of `lariat run`.

    Examples:
      lariat replay recordings/run.mcap
      lariat replay recordings/run.mcap --from 4.2
      lariat replay recordings/run.mcap --measures
      lariat replay run.mcap --service controller --service planner --json
      lariat replay tests/replay/three-cylinders.mcap --update

    Args:
        file: The recording, whole or cut.
        service: Name of a service to replay; may be repeated. Default: every service that has a
            trace in the recording.
        json: Answer with one JSON object on standard output.
        update: Replace the recorded outputs by those of this replay.
        measures: Compute the run's measures again, and replay nothing.
        from_: Moment from which the loop is run on, from the recording's first message [s].
        allow: Own method or driver that the recorded scenario names and that may be imported, such
            as "mypkg:Mine"; may be repeated.

    Returns:
        0 when everything is as recorded (or was updated), the measures could be computed, or the
        goal was reached; 1 otherwise.
    """
    console = Terminal(stderr=True)
    with tempfile.TemporaryDirectory() as folder:
        with refusing(f"cannot replay {file}"):
            recording = Recording.open(file)
            start = recording.start()
            scenario = recording.scenario(Path(folder))
            if measures:
                _report_measures(recorded_measures(recording, scenario), json)
                return 0
        require_allowed(scenario, allow)
        if from_ is not None:
            return run_scenario(scenario_at(recording, Path(folder), from_), None, json)
        skipped: dict[str, str] = {}
        names = service or traced_services(recording)
        results = replay(recording, scenario, names, console, None if service else skipped)
        if update:
            _update(recording, scenario, results)
            updated = Recording.open(file)
            heard = tuple(n for n in traced_services(updated) if n in services.LISTENERS)
            if heard:
                _update(updated, scenario, replay(updated, scenario, heard, console))
    if json:
        print(jsons.dumps(_as_json(recording, results, skipped, start)))
    else:
        _report(results, skipped, start)
    if recording.damage:
        console.print(f"{file} {recording.damage}; `lariat repair {file}` makes it whole")
    return 0 if update or all(r.same for r in results) else 1


def traced_services(recording: Recording) -> tuple[str, ...]:
    """Names of the services that have a trace in a recording, in the order of the loop."""
    prefix = topics.TRACE.at("").key
    keys = {entry.key for entry in recording.messages()}
    traced = {key.removeprefix(prefix) for key in keys if key.startswith(prefix)}
    return tuple(name for name in services.ALL if name in traced)


def replay(
    recording: Recording,
    scenario: Scenario,
    names: tuple[str, ...],
    console: Terminal,
    skipped: dict[str, str] | None = None,
) -> list[ReplayResult]:
    """Step every start of the named services again.

    `skipped` takes the reasons of services that cannot be replayed; without it they raise.
    """
    results: list[ReplayResult] = []
    for name in names:
        if name not in services.ALL:
            hint = did_you_mean(name, services.ALL) or f" use one of {', '.join(services.ALL)}"
            raise ConfigurationError(f"--service {name}: no such service;{hint}")
        try:
            results.extend(_replay_service(recording, scenario, name, console))
        except NotReplayable as reason:
            if skipped is None:
                raise
            skipped[name] = str(reason)
    return results


def _replay_service(
    recording: Recording, scenario: Scenario, name: str, console: Terminal
) -> Iterator[ReplayResult]:
    """Step every start of a service again."""
    recorded = RecordedService(recording, name)
    if not recorded.starts:
        raise ConfigurationError(
            f"{recording.path} holds no trace/{name}: the {name} did not run, or the file was "
            "not recorded by Lariat"
        )
    for session in recorded.starts:
        with (
            subject(name, scenario, session, recording, recorded) as (service, feed),
            progress_bar(console) as progress,
        ):
            bar = progress.add_task(f"{session}: warming up", total=1.0)
            service.warm_up()
            progress.update(bar, description=session)
            watch = lambda done, p=progress, b=bar: p.update(b, completed=done)  # noqa: E731
            yield replay_start(recorded, service, session, watch, feed)


def _update(recording: Recording, scenario: Scenario, results: list[ReplayResult]) -> None:
    for result in results:
        if whole := [d for d in result.differences if d.kind in KINDS]:
            d = whole[0]
            raise ConfigurationError(
                f"--update replaces fields of recorded messages, but {d.topic} #{d.sequence} of "
                f"{result.session} has no counterpart ({KINDS[d.kind]}); record the run anew"
            )
    again = {
        (entry.key, entry.publisher, entry.sequence): entry.payload
        for result in results
        for entry in result.outputs
    }
    path = recording.path.with_name(recording.path.name + ".new")
    path.unlink(missing_ok=True)
    about = {k: v for k, v in recording.metadata.items() if k not in ("version", "commit")}
    entries = recording.messages()
    first = next(entries)
    writer = Writer(path, scenario, first.log_time, about)
    # Each in its place: the order of the file says what recorder and dashboard knew at each step.
    for e in chain([first], entries):
        payload = again.get((e.key, e.publisher, e.sequence), e.payload)
        writer.write(e.topic, payload, e.publisher, e.sequence, e.log_time, e.publish_time)
    writer.close()
    os.replace(path, recording.path)


def _report(results: list[ReplayResult], skipped: dict[str, str], start: int) -> None:
    console = Terminal()
    for result in results:
        compared = sum(result.compared.values())
        verdict = "same" if result.same else f"{len(result.differences)} differences"
        console.print(
            f"{result.service} ({result.session}): {result.steps} steps, "
            f"{compared} messages compared, {verdict}; processor time of a step "
            f"{result.step_time(50):.2g} ms (p50), {result.step_time(99):.2g} ms (p99)"
        )
        for note in result.notes:
            console.print(f"  note: {note}")
        for end in result.ends:
            console.print(f"  end: {end}")
        if not result.differences:
            continue
        table = Table("time [s]", "topic", "field", "recorded", "replayed", "difference")
        for d in result.differences[:LISTED_DIFFERENCES]:
            size = f"{d.size:.3g}" if d.size < float("inf") else ""
            at = f"{(d.time - start) / SECOND:.3f}"
            place = d.field if d.field else KINDS[d.kind]
            cells = (f"{d.topic} #{d.sequence}", place, d.recorded, d.replayed)
            table.add_row(at, *cells, size)
        console.print(table)
        if len(result.differences) > LISTED_DIFFERENCES:
            console.print(f"  … and {len(result.differences) - LISTED_DIFFERENCES} more")
    for name, reason in skipped.items():
        console.print(f"{name}: not replayed: {reason}")


def _report_measures(measured: RecordedMeasures, json: bool) -> None:
    score, seen = measured.score, measured.recorded
    if json:
        recorded = MessageToDict(seen, preserving_proto_field_name=True) if seen else None
        print(jsons.dumps({**as_json(score), "by_truth": measured.by_truth, "recorded": recorded}))
        return
    console = Terminal()
    console.print(score_table(score))
    console.print(f"by the {'true' if measured.by_truth else 'seen'} rope, computed again")
    if seen is not None:
        console.print(
            f"recorded, as the controller saw it: {'reached' if seen.reached else 'not reached'}, "
            f"error {1e3 * seen.error:.2f} mm, largest {1e3 * seen.max_node_error:.2f} mm, "
            f"least clearance {1e3 * seen.min_clearance:.2f} mm, replans {seen.replans}"
        )


def _as_json(
    recording: Recording, results: list[ReplayResult], skipped: dict[str, str], start: int
) -> dict[str, Any]:
    return {
        "recording": str(recording.path),
        "scenario": recording.metadata.get("scenario", ""),
        "version": recording.metadata.get("version", ""),
        "same": all(r.same for r in results),
        "services": [
            {
                "service": r.service,
                "session": r.session,
                "steps": r.steps,
                "step_ms": {"p50": r.step_time(50), "p99": r.step_time(99)},
                "compared": dict(r.compared),
                "notes": r.notes,
                "ends": r.ends,
                "differing": dict(Counter(d.topic for d in r.differences)),
                "kinds": dict(Counter(d.kind for d in r.differences)),
                "first_differences": [
                    {
                        "time_s": (d.time - start) / SECOND,
                        "kind": d.kind,
                        "topic": d.topic,
                        "sequence": d.sequence,
                        "field": d.field,
                        "recorded": d.recorded,
                        "replayed": d.replayed,
                    }
                    for d in r.differences[:LISTED_DIFFERENCES]
                ],
            }
            for r in results
        ],
        "not_replayed": skipped,
        "damage": recording.damage,
    }
