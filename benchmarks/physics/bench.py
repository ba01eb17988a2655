"""The rod against closed forms: `lariat bench physics`."""

from __future__ import annotations

import json as encoder
import sys
from pathlib import Path

from benchmarks.physics.cases import CASES


def run(plot: Path | None = None, json: bool = False) -> int:
    """Measure every case, print a table or one JSON object, and say whether all bounds hold.

    Args:
        plot: Where a picture of shapes and errors goes, as a PNG.
        json: One JSON object on standard output instead of a table.
    """
    rows = []
    for name, case in CASES.items():
        for count, bound in zip(case.node_counts, case.bounds, strict=True):
            print(f"{name}, {count} nodes ...", file=sys.stderr)
            rows.append(
                {
                    "case": name,
                    "nodes": count,
                    "error": case.error(count),
                    "unit": case.unit,
                    "bound": bound if bound < 1 else None,
                }
            )
    held = all(row["bound"] is None or row["error"] <= row["bound"] for row in rows)
    if json:
        print(encoder.dumps({"cases": rows, "held": held}))
    else:
        print(f"{'case':<18}{'nodes':>6}{'error':>12} {'unit':<5}{'at most':>9}")
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
