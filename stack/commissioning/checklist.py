"""Checklist of the first day: its steps, in order, and how they are gone through."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from datetime import datetime

from lariat.configuration import ConfigurationError
from lariat.scenario import Scenario
from stack.client import RequestFailed
from stack.commissioning import checks, motions
from stack.commissioning.record import (
    FAILED,
    OPEN,
    PASSED,
    CommissioningRecord,
    Result,
    fingerprint,
)
from stack.commissioning.session import NotPassed, Session


def _always(scenario: Scenario) -> str:
    return ""


@dataclass(frozen=True)
class Step:
    """Step of the checklist."""

    name: str
    """Name in the record."""
    title: str
    """What it checks, in words."""
    check: Callable[[Session], str]
    """Carries it out and returns what was found."""
    settings: tuple[str, ...]
    """Sections of the scenario on which its result rests."""
    obstacle: Callable[[Scenario], str] = _always
    """Returns why it has no meaning for a cell as it runs now; empty when it has."""
    lasting: bool = True
    """Whether its result outlasts the session; otherwise it is carried out in every session in
    which a lasting one is."""


CELL = ("rope", "ends", "start", "goal", "obstacles", "table")
"""Sections that describe the cell."""
RUN = (*CELL, "limits")
"""Sections on which a motion rests."""
STEPS = (
    Step("scenario", "The cell's file, checked with the rod", checks.scenario, CELL),
    Step("limits", "Limits of the first day", checks.limits, ("limits",)),
    Step("processes", "Processes and versions", checks.processes, (), lasting=False),
    Step("arms", "Arms answer, with the poses of the pendant", checks.arms, ("ends",)),
    Step("load", "Load and tool", checks.load, ("ends",)),
    Step(
        "emergency stop",
        "Hard-wired emergency stop",
        checks.emergency_stop,
        ("ends",),
        checks.no_real_arm,
    ),
    Step(
        "camera",
        "Camera and its calibration",
        checks.camera,
        ("sensing", "cameras"),
        checks.no_camera,
    ),
    Step("arming", "Power", motions.arming, (), lasting=False),
    Step("start", "Way to the start", motions.start, (), lasting=False),
    Step(
        "run without rope",
        "Slow run without a rope",
        motions.run_without_rope,
        RUN,
        motions.rope_expected,
    ),
    Step("stop drill", "Stop in motion", motions.stop_drill, RUN),
    Step(
        "run with rope",
        "Slow run with the rope",
        motions.run_with_rope,
        (*RUN, "sensing", "cameras"),
        motions.rope_simulated,
    ),
    Step("power off", "Power off", motions.power_off, (), lasting=False),
)
"""All steps, in order."""


def go_through(session: Session, record: CommissioningRecord, now: Callable[[], datetime]) -> bool:
    """Go through the steps that have not passed yet, up to the first one that fails.

    Args:
        session: Cell, stack and person.
        record: Results, which are kept with every step.
        now: Returns the local time.

    Returns:
        Whether no step has failed.
    """
    due = any(step.lasting and _due(step, session, record) for step in STEPS)
    for number, step in enumerate(STEPS, start=1):
        head = f"{number}/{len(STEPS)} {step.title}"
        settings = fingerprint(session.scenario, step.settings)
        obstacle = step.obstacle(session.scenario)
        if step.lasting and record.holds(step.name, settings):
            session.operator.tell(f"{head}: passed on {record.results[step.name].when}")
            continue
        if not due:
            session.operator.tell(f"{head}: {f'open, {obstacle}' if obstacle else 'not needed'}")
            continue
        session.operator.begin(number)
        session.operator.tell(f"{head} …")
        outcome, detail = (OPEN, obstacle) if obstacle else _carry_out(step, session)
        when = now().isoformat(timespec="seconds")
        record.put(step.name, Result(outcome, detail, when, settings))
        session.operator.tell(f"  {outcome}: {detail}")
        if outcome == FAILED:
            return False
    session.operator.begin(0)
    return True


def _due(step: Step, session: Session, record: CommissioningRecord) -> bool:
    """Whether a step has a meaning for the cell as it runs, and has not passed."""
    settings = fingerprint(session.scenario, step.settings)
    return not step.obstacle(session.scenario) and not record.holds(step.name, settings)


def _carry_out(step: Step, session: Session) -> tuple[str, str]:
    try:
        return PASSED, step.check(session)
    except (NotPassed, RequestFailed, ConfigurationError) as reason:
        return FAILED, str(reason)
