"""Runs of one and two CR5s among posts and boxes: `lariat bench arms`."""

from __future__ import annotations

import json as encoder
from collections.abc import Sequence
from dataclasses import asdict
from itertools import product
from pathlib import Path

import numpy as np
from rich.markup import escape
from rich.table import Table

from benchmarks.arms.scenes import BASES
from benchmarks.arms.trial import MAX_ERROR_MM, ArmSpec, ArmTrial, run_trial
from benchmarks.campaign import Campaign, success_interval
from benchmarks.result_block import find_block, show
from benchmarks.worker_pool import Workers


def run(
    arms: tuple[int, ...] = (1, 2),
    count: int = 5,
    first: int = 0,
    seed: int = 0,
    results: Path | None = None,
    workers: Workers = 1,
    docs: Path | None = None,
    json: bool = False,
) -> int:
    """Run emulated CR5s in seeded scenes whose obstacles also stand where the arms' links go.

    Each goal can be held by rope, grippers and arms; whether a way leads there is not known. The
    plant is that of the base scenario, finer than the model; true nodes are sensed and nothing is
    adapted, so that what fails is the way.

    Examples:
      lariat bench arms
      lariat bench arms --arms 2 --count 50 --results arms.jsonl

    Args:
        arms: Numbers of arms.
        count: Number of scenes for each.
        first: Number of the first scene.
        seed: Seed of the scenes.
        results: File of finished trials, one JSON object a line; trials that it holds are not run
            again.
        workers: Number of processes, or the address of a Dask scheduler.
        docs: Folder of pages, in which the block of this command is written; none by default.
        json: Print one JSON object instead of a table.

    Returns:
        0 if all goals were reached and nothing was refused, else 1.
    """
    block = find_block(docs)
    unknown = set(arms) - set(BASES)
    if unknown:
        raise ValueError(f"--arms takes 1 and 2, not {sorted(unknown)}")
    specs = [ArmSpec(k, number, seed) for k, number in product(arms, range(first, first + count))]
    trials = Campaign(run_trial, ArmTrial, _line).trials(specs, results, workers)
    if json:
        print(encoder.dumps({"trials": [asdict(trial) for trial in trials]}))
    else:
        show([_table(trials)], block)
    return 0 if trials and all(t.reached and not t.in_the_way for t in trials) else 1


def _line(trial: ArmTrial) -> str:
    error = "not started" if trial.error_mm is None else f"{trial.error_mm:.2f} mm off"
    parts = [f"{error}, {trial.reason}"]
    if trial.fault_without_arms:
        parts.append(f"without arms in the plan, {trial.fault_without_arms}")
    if trial.refusals:
        parts.append(f"refused by {', '.join(trial.refusals)}")
    return (
        f"{trial.spec.arms} arms, scene {trial.spec.number}: planned in {trial.plan_s:.1f} s of "
        f"processor time; {'; '.join(parts)}"
    )


def _table(trials: Sequence[ArmTrial]) -> Table:
    table = Table(
        caption=f"reached: within {MAX_ERROR_MM:g} mm, nothing touched; true nodes, not adapting; "
        "plan: processor time"
    )
    for name in (
        "arms",
        "scenes",
        "arm in the way",
        "planned",
        "reached",
        "95 % interval",
        "refused for arms",
        "otherwise",
        "touched",
        "error median / worst [mm]",
        "plan p50 / p90 / max [s]",
    ):
        table.add_column(escape(name), justify="right")
    for k in sorted({t.spec.arms for t in trials}):
        rows = [t for t in trials if t.spec.arms == k]
        errors = [t.error_mm for t in rows if t.error_mm is not None and t.reached]
        plans = [t.plan_s for t in rows]
        low, high = success_interval(sum(t.reached for t in rows), len(rows))
        table.add_row(
            str(k),
            str(len(rows)),
            str(sum(bool(t.fault_without_arms) for t in rows)),
            str(sum(t.planned for t in rows)),
            str(sum(t.reached for t in rows)),
            f"{100.0 * low:.0f} to {100.0 * high:.0f} %",
            str(sum(t.in_the_way for t in rows)),
            str(sum(bool(t.refusals) and not t.in_the_way for t in rows)),
            str(sum(t.touched for t in rows)),
            f"{np.median(errors):.2f} / {max(errors):.2f}" if errors else "-",
            " / ".join(f"{v:.1f}" for v in np.quantile(plans, [0.5, 0.9, 1.0])),
        )
    return table
