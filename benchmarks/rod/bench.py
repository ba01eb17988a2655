"""Speed and robustness of the rod: `lariat bench rod`."""

from __future__ import annotations

from typing import Literal, get_args

from benchmarks.campaign import Workers
from benchmarks.rod import hard_cases, times
from benchmarks.tables import PRINT_DEFAULTS, Flat, PrintOptions, Result

Part = Literal["speed", "history", "batch", "start", "hard"]
ALL_PARTS: tuple[Part, ...] = get_args(Part)
"""All parts, in the order of their tables."""
CONDITIONS: dict[Part, str] = {
    "speed": "least processor time of 5 steps of 10 ms of a moving rod among four obstacles",
    "history": "least processor time of 20 steps of 10 ms of a rope drawn along a table, n = 40",
    "batch": "64 ropes, n = 40, 5 steps of 10 ms, no obstacles; wall time",
    "start": "time of a fresh process until its first gradient, n = 10, without and with kept code",
    "hard": "random rods of 5 to 401 nodes, both ends yanked, an obstacle in their middle",
}
"""Conditions of each table; plant, camera and adaptation are not involved."""


def run(
    part: tuple[Part, ...] = ALL_PARTS,
    cases: int = 1000,
    workers: Workers = 1,
    options: Flat[PrintOptions] = PRINT_DEFAULTS,
) -> int:
    """Measure speed, start-up and robustness of the rod.

    The parts are: `speed` (time of roll-outs and gradients by number of nodes), `history` (what set
    and friction add to them), `batch` (throughput of many rods on threads), `start` (time until the
    first gradient of a process) and `hard` (rods that are yanked and start inside an obstacle).
    The rod is measured alone: no plant, camera or adaptation.

    Examples:
      lariat bench rod --part speed batch

    Args:
        part: Parts to measure; all by default.
        cases: Number of random rods of the part `hard`.
        workers: Number of processes for `hard`, or the address of a Dask scheduler.
    """
    measures = {
        "speed": times.by_size,
        "history": times.by_history,
        "batch": times.by_batch,
        "start": times.first_launch,
        "hard": lambda: [hard_cases.measure(cases, workers)],
    }
    options.publish(*(Result(name, measures[name](), CONDITIONS[name]) for name in part))
    return 0
