"""`lariat replay FILE`: services are fed their recorded inputs, and what they say is compared."""

from __future__ import annotations

import json as jsons
import os
import tempfile
from collections import Counter
from pathlib import Path
from typing import Annotated, Any

import tyro
from rich.console import Console
from rich.markup import escape
from rich.progress import Progress
from rich.table import Table

from shared.configuration import ConfigurationError
from shared.recording import Recording, Writer
from shared.scenario import Scenario
from shared.service import SECOND
from stack import services
from stack.replay.trace_replay import Evidence, Retraced, retrace

DEFAULT = ("controller", "perception")
SHOWN = 12
"""Differences that are listed for each start of a service."""


def main(
    file: tyro.conf.Positional[Path],
    /,
    service: Annotated[
        tyro.conf.UseAppendAction[tuple[str, ...]], tyro.conf.arg(metavar="NAME")
    ] = (),
    json: bool = False,
    update: bool = False,
) -> int:
    """Feed services the inputs that a recording holds, and compare their outputs with it.

    Each field must be what was recorded, within the tolerance of its topic (shared/topics.py).

    Examples:
      lariat replay recordings/run.mcap
      lariat replay run.mcap --service controller --service planner --json
      lariat replay tests/replay/reference.mcap --update

    Args:
        file: The recording, whole or cut.
        service: Which service to replay, by name; may be repeated. Default: controller, perception.
        json: Answer with one JSON object on standard output.
        update: Put what the services say now in the place of what was recorded.

    Returns:
        0 when everything is as recorded (or was updated), 1 when something differs.
    """
    console = Console(stderr=True, highlight=False)
    with tempfile.TemporaryDirectory() as folder:
        try:
            recording = Recording.open(file)
            scenario = recording.scenario(Path(folder))
        except ValueError as error:
            raise ConfigurationError(str(error)) from error
        results = replay(recording, scenario, service or DEFAULT, console)
        if update:
            _update(recording, scenario, results)
    start = next(recording.messages()).log_time
    if json:
        print(jsons.dumps(_as_json(recording, results, start)))
    else:
        _report(results, start)
    if recording.damage:
        console.print(f"{file} {recording.damage}; `lariat repair {file}` makes it whole")
    return 0 if update or all(r.same for r in results) else 1


def replay(
    recording: Recording, scenario: Scenario, names: tuple[str, ...], console: Console
) -> list[Retraced]:
    """Every start of the named services, stepped again.

    Raises:
        ConfigurationError: A service is unknown or has no trace in the recording.
    """
    results = []
    for name in names:
        if name not in services.NAMES:
            known = ", ".join(services.NAMES)
            raise ConfigurationError(f"--service {name}: no such service; use one of {known}")
        evidence = Evidence(recording, name)
        if not evidence.traces:
            raise ConfigurationError(
                f"{recording.path} holds no trace/{name}: the {name} did not run, or the file was "
                "not recorded by Lariat"
            )
        for session in evidence.traces:
            service = services.build(name, scenario, session, evidence.traces[session][0].now)
            with Progress(
                console=console, transient=True, redirect_stdout=False, redirect_stderr=False
            ) as progress:
                bar = progress.add_task(f"{session}: warming up", total=1.0)
                service.warm_up()
                progress.update(bar, description=session)
                watch = lambda done, p=progress, b=bar: p.update(b, completed=done)  # noqa: E731
                results.append(retrace(evidence, service, session, watch))
    return results


def _update(recording: Recording, scenario: Scenario, results: list[Retraced]) -> None:
    sessions = {r.session: {*r.compared} for r in results}
    kept = [
        entry
        for entry in recording.messages()
        if entry.key not in sessions.get(entry.publisher, ())
    ]
    # What was never recorded was still under way when the recording ended.
    recorded = {(e.key, e.publisher, e.sequence) for e in recording.messages()}
    again = [
        entry
        for result in results
        for entry in result.outputs
        if (entry.key, entry.publisher, entry.sequence) in recorded
    ]
    entries = sorted([*kept, *again], key=lambda entry: entry.log_time)
    path = recording.path.with_name(recording.path.name + ".new")
    path.unlink(missing_ok=True)
    about = {k: v for k, v in recording.metadata.items() if k not in ("version", "commit")}
    writer = Writer(path, scenario, entries[0].log_time, about)
    for e in entries:
        writer.write(e.topic, e.payload, e.publisher, e.sequence, e.log_time)
    writer.close()
    os.replace(path, recording.path)


def _report(results: list[Retraced], start: int) -> None:
    console = Console(highlight=False)
    for result in results:
        compared = sum(result.compared.values())
        verdict = "same" if result.same else f"{len(result.differences)} fields differ"
        console.print(
            f"[bold]{result.service}[/] ({result.session}): {result.steps} steps, "
            f"{compared} messages compared, {verdict}"
        )
        for note in result.notes:
            console.print(f"  note: {note}")
        if not result.differences:
            continue
        table = Table("time [s]", "topic", "field", "recorded", "replayed", "difference")
        for d in result.differences[:SHOWN]:
            size = f"{d.size:.3g}" if d.size < float("inf") else ""
            at = f"{(d.time - start) / SECOND:.3f}"
            cells = (f"{d.topic} #{d.sequence}", d.field, d.recorded, d.replayed)
            # Indices stand in brackets, which rich takes for markup.
            table.add_row(at, *map(escape, cells), size)
        console.print(table)
        if len(result.differences) > SHOWN:
            console.print(f"  … and {len(result.differences) - SHOWN} more")


def _as_json(recording: Recording, results: list[Retraced], start: int) -> dict[str, Any]:
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
                "compared": dict(r.compared),
                "notes": r.notes,
                "differing": dict(Counter(d.topic for d in r.differences)),
                "first_differences": [
                    {
                        "time_s": (d.time - start) / SECOND,
                        "topic": d.topic,
                        "sequence": d.sequence,
                        "field": d.field,
                        "recorded": d.recorded,
                        "replayed": d.replayed,
                    }
                    for d in r.differences[:SHOWN]
                ],
            }
            for r in results
        ],
        "damage": recording.damage,
    }
