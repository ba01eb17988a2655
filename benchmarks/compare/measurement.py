"""Errors and processor times of all contenders, measured in turn on one core."""

from __future__ import annotations

import importlib
import importlib.util
import os
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from benchmarks.compare import continuum, mujoco_ropes, our_rod
from benchmarks.compare.continuum import Continuum
from benchmarks.compare.motion import ACTION_COUNT, Contender, actions

ROUNDS, ROUND_TIME = 3, 0.7
"""Number of runs of a contender, of which the fastest counts, and time above which it runs once."""
REFERENCE = "reference"
"""Name of the row with the continuum's own error."""
EXTRAS = {"elastica": ("PyElastica", "elastica_rod"), "newton": ("Newton cable", "newton_cable")}
"""Solvers of packages that the stack does not need: name and module here, by their package."""


@dataclass(frozen=True)
class WorkPrecision:
    """Time and errors of a solver with one setting."""

    solver: str
    """Name of the solver."""
    nodes: int
    """Number of nodes n."""
    setting: str
    """Time step, and sweeps in each."""
    us: float
    """Least processor time for 10 ms of motion [us]."""
    moving_mm: float
    """Mean node distance from the continuum in motion [mm]."""
    worst_mm: float
    """Largest node distance from the continuum in motion [mm]."""
    rest_mm: float
    """Mean node distance from the continuum at rest [mm]."""


def points() -> Iterator[WorkPrecision]:
    """Yield the continuum's own error, then a row for every contender."""
    there = continuum.solve(actions())
    yield WorkPrecision(
        REFERENCE, continuum.NODE_COUNT, "by Richardson", np.nan, there.doubt_mm, np.nan, np.nan
    )
    entered = list(contenders())
    rows = [_measure(contender, there) for contender in entered]
    for _ in range(1, ROUNDS):
        for k, contender in enumerate(entered):
            if rows[k].us * ACTION_COUNT < 1e6 * ROUND_TIME:
                rows[k] = replace(rows[k], us=min(rows[k].us, _timed_run(contender)[1]))
    yield from rows
    for package, (solver, _) in EXTRAS.items():
        if importlib.util.find_spec(package) is None:
            absent = "not installed: pip install -e '.[bench]'"
            yield WorkPrecision(solver, 0, absent, *[np.nan] * 4)


def contenders() -> Iterator[Contender]:
    """Yield every solver that is installed, with all its settings."""
    yield from our_rod.contenders()
    yield from our_rod.paper_contenders()
    yield from mujoco_ropes.contenders()
    for package in EXTRAS:
        if (module := extra(package)) is not None:
            yield from module.contenders()


def extra(package: str) -> Any:
    """Return the module of a solver that the stack does not need; None if it is not installed."""
    if importlib.util.find_spec(package) is None:
        return None
    return importlib.import_module(f"benchmarks.compare.{EXTRAS[package][1]}")


@contextmanager
def one_core() -> Iterator[None]:
    """Keep this process on one core, where the system can."""
    if not hasattr(os, "sched_setaffinity"):
        yield
        return
    allowed = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {max(allowed)})
    try:
        yield
    finally:
        os.sched_setaffinity(0, allowed)


def _measure(contender: Contender, there: Continuum) -> WorkPrecision:
    # The first run of a setting compiles, reads caches and takes memory.
    contender.start(actions()[:1]).run()
    simulation, us, path = _timed_run(contender)
    errors = there.moving_errors(path)
    return WorkPrecision(
        contender.solver,
        contender.nodes,
        contender.setting,
        us,
        float(errors.mean()),
        float(errors.max()),
        float(there.rest_errors(simulation.settle()).mean()),
    )


def _timed_run(contender: Contender):
    simulation = contender.start(actions())
    began = time.process_time()
    path = simulation.run()
    return simulation, 1e6 * (time.process_time() - began) / ACTION_COUNT, path
