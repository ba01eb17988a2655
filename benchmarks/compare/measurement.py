"""Errors and processor times of all contenders, measured in turn on one core."""

from __future__ import annotations

import importlib
import importlib.util
import os
import time
from collections.abc import Iterator
from contextlib import contextmanager
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


def points() -> list[dict[str, Any]]:
    """Return the continuum's own error, then a row for every contender.

    `us` is the least processor time for 10 ms of motion, the errors are distances of nodes from the
    continuum [mm]: mean and largest in motion, and mean at rest.
    """
    there = continuum.solve(actions())
    entered = list(contenders())
    rows = [_measure(contender, there) for contender in entered]
    for _ in range(1, ROUNDS):
        for row, contender in zip(rows, entered, strict=True):
            if row["us"] * ACTION_COUNT < 1e6 * ROUND_TIME:
                row["us"] = min(row["us"], _timed_run(contender)[1])
    reference = _row(REFERENCE, continuum.NODE_COUNT, "by Richardson")
    absent = [
        _row(solver, 0, "not installed: pip install -e '.[bench]'")
        for package, (solver, _) in EXTRAS.items()
        if importlib.util.find_spec(package) is None
    ]
    return [{**reference, "moving_mm": there.own_error_mm}, *rows, *absent]


def _row(solver: str, nodes: int, setting: str, *figures: float) -> dict[str, Any]:
    names = ("us", "moving_mm", "worst_mm", "rest_mm")
    values = figures or (np.nan,) * len(names)
    row = {"solver": solver, "nodes": nodes, "setting": setting}
    return row | dict(zip(names, values, strict=True))


def contenders() -> Iterator[Contender]:
    """Yield every solver that is installed, with all its settings."""
    yield from our_rod.contenders()
    yield from our_rod.paper_contenders()
    yield from mujoco_ropes.contenders()
    for package, (_, module) in EXTRAS.items():
        if importlib.util.find_spec(package) is not None:
            yield from importlib.import_module(f"benchmarks.compare.{module}").contenders()


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


def _measure(contender: Contender, there: Continuum) -> dict[str, Any]:
    # The first run of a setting compiles, reads caches and takes memory.
    contender.start(actions()[:1]).run()
    simulation, us, path = _timed_run(contender)
    errors = there.moving_errors(path)
    rest = float(there.rest_errors(simulation.settle()).mean())
    setting = contender.solver, contender.nodes, contender.setting
    return _row(*setting, us, float(errors.mean()), float(errors.max()), rest)


def _timed_run(contender: Contender):
    simulation = contender.start(actions())
    began = time.process_time()
    path = simulation.run()
    return simulation, 1e6 * (time.process_time() - began) / ACTION_COUNT, path
