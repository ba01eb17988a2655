"""Faults injected into the whole live stack in the middle of a motion: `lariat bench faults`.

What the arm does is read from the emulator's own log of its joints, not from what the gateway says.
"""

from __future__ import annotations

import json as encoder
import sys
import tempfile
from dataclasses import asdict
from pathlib import Path
from typing import Literal

from benchmarks.faults.cases import CASES
from benchmarks.faults.cell import OTHER, FaultCell, Missing
from benchmarks.faults.trial import Finding, trial
from shared.configuration import ConfigurationError
from shared.messages import ArmStates
from shared.scenario import load
from stack.client import RequestFailed

SCENARIO = Path(__file__).parents[2] / "scenarios" / "fixed-end.toml"


def run(
    cases: tuple[str, ...] = (),
    scenario: Path = SCENARIO,
    firmware: Literal["v3", "v4"] = "v3",
    folder: Path | None = None,
    json: bool = False,
) -> int:
    """Kills, freezes and cuts what moves an arm, and reads in the arm's own log what it did.

    Needs the loopback addresses 127.0.0.41 and 127.0.0.42 and about 12 s for each case.

    Args:
        cases: Names of the faults, as in the first column; all that the scenario can have without
            any.
        scenario: One with a CR5 at its right end; both ends for other-arm-killed.
        firmware: Of the emulated arm.
        folder: For the logs of stack and joints; a temporary one without.
        json: One JSON object instead of a table.

    Returns:
        0 when all that docs/safety.md promises held, 1 when not.
    """
    two = load(scenario).end(OTHER).driver == "cr5"
    chosen = cases or tuple(n for n, case in CASES.items() if two or not case.two_arms)
    for name in chosen:
        if name not in CASES:
            raise ConfigurationError(f"no case {name!r}; there are {', '.join(CASES)}")
        if CASES[name].two_arms and not two:
            raise ConfigurationError(
                f"{name} needs two arms; try --scenario scenarios/two-arms.toml"
            )
    with tempfile.TemporaryDirectory() as temporary:
        place = folder or Path(temporary)
        place.mkdir(parents=True, exist_ok=True)
        # Those that need a router come last, on a stack of their own.
        both = [[n for n in chosen if CASES[n].routed == routed] for routed in (False, True)]
        findings = [
            f
            for names in both
            if names
            for f in _findings(names, scenario, place.resolve(), firmware)
        ]
    if json:
        print(encoder.dumps({"firmware": firmware, "cases": [asdict(f) for f in findings]}))
    else:
        _print(findings)
    return 0 if findings and all(f.ok for f in findings) else 1


def _findings(chosen: list[str], scenario: Path, folder: Path, firmware: str) -> list[Finding]:
    print("starting the stack", file=sys.stderr)
    cell = FaultCell(scenario, folder, firmware, CASES[chosen[0]].routed)
    findings = []
    silence = "hold"
    try:
        cell.look()
        cell.until(lambda: bool(cell.states) and bool(cell.task_state), 20.0, "no state")
        cell.until(lambda: cell.arms.mode == ArmStates.DISARMED, 5.0, "not disarmed at boot")
        cell.until(lambda: cell.heard, 20.0, "the arm is not heard")
        cell.arm()
        for name in chosen:
            if CASES[name].silence != silence:
                silence = CASES[name].silence
                cell.change_arm(silence)
            finding = trial(cell, name)
            findings.append(finding)
            print(_line(finding), file=sys.stderr, flush=True)
            if not finding.reached:
                print("the cell did not recover; what follows is left out", file=sys.stderr)
                break
    except (Missing, RequestFailed) as missing:
        print(f"given up: {missing}", file=sys.stderr)
    finally:
        cell.close()
    return findings


def _line(f: Finding) -> str:
    words = "ok" if f.ok else f"NOT OK: {f.trouble}"
    return f"{f.case}: {f.cause or 'nothing stops'} ({f.reason}); {_times(f)}; {f.resumed}; {words}"


def _times(f: Finding) -> str:
    """All that a run which is cut short would lose."""
    noticed, braking, rest = (_milliseconds(t) for t in (f.noticed_s, f.braking_s, f.rest_s))
    return (
        f"noticed {noticed}, braking {braking}, rest {rest} ms, crept {1e3 * f.crept_rad:.2f} mrad"
    )


def _milliseconds(seconds: float | None) -> str:
    return "–" if seconds is None else f"{1e3 * seconds:.0f}"


def _print(findings: list[Finding]) -> None:
    from rich.console import Console
    from rich.table import Table

    table = Table(box=None, pad_edge=False)
    heads = ("case", "fault", "cause", "noticed ms", "braking ms", "rest ms", "crept mrad")
    for head in (*heads, "resumed", "goal", ""):
        table.add_column(head, justify="right" if head.endswith(("ms", "mrad")) else "left")
    for f in findings:
        times = (_milliseconds(t) for t in (f.noticed_s, f.braking_s, f.rest_s))
        table.add_row(
            f.case,
            f.what,
            f.cause or "none",
            *times,
            f"{1e3 * f.crept_rad:.2f}",
            f.resumed,
            "reached" if f.reached else "not reached",
            "ok" if f.ok else f.trouble,
        )
    Console(file=sys.stdout, width=200).print(table)
