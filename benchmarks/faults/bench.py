"""Fault injection into the live stack: `lariat bench faults`.

The motion of the arm is measured by the emulator's joint log, independently of the gateway.
"""

from __future__ import annotations

import itertools
import sys
import tempfile
from collections import defaultdict
from contextlib import ExitStack
from pathlib import Path
from typing import Any, Literal

from benchmarks.campaign import figures_in_words
from benchmarks.faults.arms import OTHER_SIDE, Arms
from benchmarks.faults.cases import CASES
from benchmarks.faults.cell import FaultCell, RoutedCell
from benchmarks.faults.fault_trial import Phase, observe, run_trial
from benchmarks.operator import DeadlineMissed
from benchmarks.tables import PRINT_DEFAULTS, Flat, PrintOptions, Result
from lariat.configuration import ConfigurationError
from lariat.scenario import load
from lariat.scenario.shipped import find
from shared.messages import ArmStates
from stack.client import RequestFailed
from stack.launcher.launcher import DEATH_WINDOW

DEFAULT_SCENARIO = find("fixed-end")
"""Scenario with one arm, a CR5 at its right end."""


def run(
    cases: tuple[str, ...] = (),
    scenario: Path = DEFAULT_SCENARIO,
    firmware: Literal["v3", "v4"] = "v3",
    phases: tuple[Phase, ...] = ("moving",),
    seconds: float | None = None,
    options: Flat[PrintOptions] = PRINT_DEFAULTS,
) -> int:
    """Inject faults into a live cell and measure how the arm stops.

    Processes are killed, frozen, slowed or raise an exception, and the arm's connection is
    disturbed; `router-killed` has a stack of its own, whose processes meet at a router. Needs the
    loopback addresses 127.0.0.41 to 127.0.0.43 and about 12 s for each case.

    Args:
        cases: Names of the faults, as in the first column; by default all that the scenario allows.
        scenario: A scenario with a CR5 at its right end; at both ends for other-arm-killed.
        firmware: Firmware of the emulated arms.
        phases: Phases of operation in which each fault is injected. A resting arm must not move
            before a person agrees.
        seconds: Time until each fault is repaired [s]; by default 1 s.

    Returns:
        0 when every promise of docs/concepts/safety.md was kept, 1 otherwise.
    """
    two_arms = load(scenario).end(OTHER_SIDE).driver == "cr5"
    chosen = cases or tuple(
        name for name, case in CASES.items() if not case.routed and (two_arms or not case.two_arms)
    )
    for name in chosen:
        if name not in CASES:
            raise ConfigurationError(f"no case {name!r}; expected one of {', '.join(CASES)}")
        if CASES[name].two_arms and not two_arms:
            raise ConfigurationError(
                f"{name} needs two arms; try --scenario scenarios/two-arms.toml"
            )
        if CASES[name].routed and len(chosen) > 1:
            raise ConfigurationError(f"{name} needs a stack of its own; give it alone")
    with tempfile.TemporaryDirectory() as folder:
        results = _run_trials(chosen, phases, seconds, Arms(scenario, Path(folder), firmware))
    options.publish(Result("faults", results, f"firmware {firmware}"))
    return 0 if results and all(f["ok"] for f in results) else 1


def _run_trials(
    chosen: tuple[str, ...], phases: tuple[Phase, ...], seconds: float | None, arms: Arms
) -> list[dict[str, Any]]:
    print("starting the stack", file=sys.stderr)
    results: list[dict[str, Any]] = []
    silence = "hold"
    with ExitStack() as cleanup:
        cleanup.callback(arms.close)
        cell = (RoutedCell if CASES[chosen[0]].routed else FaultCell)(arms)
        cleanup.callback(cell.end_stack)
        try:
            heard = lambda: bool(cell.states) and bool(cell.task.ByteSize())  # noqa: E731
            cell.wait_until(heard, 20.0, "no state")
            cell.wait_until(lambda: cell.arms.mode == ArmStates.DISARMED, 5.0, "not disarmed")
            cell.wait_until_connected()
            cell.arm()
            deaths: defaultdict[str, list[float]] = defaultdict(list)
            for phase, name in itertools.product(phases, chosen):
                # The launcher gives up a process that dies three times within this time.
                for died in (deaths[process] for process in CASES[name].restarted):
                    observe(cell, died[-2] + DEATH_WINDOW if len(died) > 1 else 0.0)
                if CASES[name].silence != silence:
                    silence = CASES[name].silence
                    cell.replace_arm(silence)
                results.append(run_trial(cell, name, phase, seconds))
                for process in CASES[name].restarted:
                    deaths[process].append(cell.now())
                print(figures_in_words(results[-1]), file=sys.stderr, flush=True)
                if not results[-1]["reached"]:
                    print("the cell did not recover; the rest is skipped", file=sys.stderr)
                    break
        except (DeadlineMissed, RequestFailed) as error:
            print(f"given up: {error}", file=sys.stderr)
    return results
