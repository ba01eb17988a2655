"""The rod against closed-form solutions: `lariat bench physics`."""

from __future__ import annotations

import json as encoder
import sys
from pathlib import Path

from benchmarks.physics.problems import PROBLEMS


def run(plot: Path | None = None, json: bool = False) -> int:
    """Compare the rod with closed-form solutions, and its errors with their bounds.

    There is no plant, camera or adaptation: each error is that of the rod itself with n nodes.

    Examples:
      lariat bench physics --plot docs/rod-physics.png

    Args:
        plot: File for a plot of shapes and errors, a PNG.
        json: Print one JSON object instead of a table.

    Returns:
        0 if all errors are within their bounds, else 1.
    """
    rows = []
    for name, problem in PROBLEMS.items():
        for count, bound in zip(problem.node_counts, problem.bounds, strict=True):
            print(f"{name}, {count} nodes ...", file=sys.stderr)
            rows.append(
                {
                    "case": name,
                    "nodes": count,
                    "error": problem.error(count),
                    "unit": problem.unit,
                    "bound": bound if bound < 1 else None,
                }
            )
    held = all(row["bound"] is None or row["error"] <= row["bound"] for row in rows)
    if json:
        print(encoder.dumps({"cases": rows, "held": held}))
    else:
        print("Lariat's rod with n nodes against closed-form solutions")
        print(f"{'problem':<18}{'n':>6}{'error':>12} {'unit':<5}{'bound':>9}")
        for row in rows:
            bound = "" if row["bound"] is None else f"{row['bound']:.1e}"
            print(
                f"{row['case']:<18}{row['nodes']:>6}{row['error']:>12.2e} "
                f"{row['unit']:<5}{bound:>9}"
            )
    if plot is not None:
        from benchmarks.physics.plot import draw

        draw(rows, plot)
    return 0 if held else 1
