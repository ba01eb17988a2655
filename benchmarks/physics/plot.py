"""Plot of the rod over the closed forms."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from benchmarks.physics import problems

COARSE_COUNT, FINE_COUNT = 10, 320
"""Number of nodes of the plotted rods, and number of points of the closed forms."""


def draw(rows: Sequence[Mapping[str, Any]], path: Path) -> None:
    """Write a plot of three shapes with few nodes, and of every error over the number of nodes.

    Args:
        rows: Rows of the table of `lariat bench physics`.
        path: File to write, a PNG.
    """
    import matplotlib

    matplotlib.use("agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(2, 2, figsize=(10, 7))
    hanging, strut, helix, errors = axes.ravel()
    for name, color, shapes in (
        ("heavy cantilever", "tab:blue", problems.cantilever(COARSE_COUNT, 4e8, FINE_COUNT)),
        ("limp cantilever", "tab:orange", problems.cantilever(COARSE_COUNT, 1e8, FINE_COUNT)),
        ("catenary", "tab:green", (problems.hung(COARSE_COUNT)[0], problems.hung(FINE_COUNT)[1])),
    ):
        nodes, exact = shapes
        hanging.plot(*exact.T, color=color, label=name)
        hanging.plot(*nodes.T, "o", color=color, markersize=4)
    hanging.set_title(
        f"Under their weight: closed form (line), rod of {COARSE_COUNT} nodes", fontsize=9
    )
    nodes, exact = problems.strut(COARSE_COUNT)
    strut.plot(exact[:, 0], -exact[:, 1], color="black", label="Euler's elastica")
    strut.plot(nodes[:, 0], -nodes[:, 1], "o", markersize=4, label=f"rod, {COARSE_COUNT} nodes")
    strut.set_title("A strut between pins, buckled", fontsize=9)
    for axis in (hanging, strut):
        axis.set_aspect("equal", "datalim")
        axis.set_xlabel("x [L]")
        axis.set_ylabel("z [L]")
    nodes, _ = problems.buckled(80)
    _, exact = problems.buckled(180)
    helix.plot(*exact.T, color="black", label="tanh$^2$")
    helix.plot(*nodes.T, "o", markersize=3, label="rod, 80 nodes")
    helix.set_title("Helical buckling, localised: envelope of the tangent", fontsize=9)
    helix.set_xlabel("arc length [width of the closed form]")
    for name in dict.fromkeys(row["case"] for row in rows):
        points = [(r["nodes"], r["error"]) for r in rows if r["case"] == name]
        # An error at the level of rounding has no order of convergence.
        if points[0][1] > 1e-9:
            errors.loglog(*zip(*points, strict=True), "o-", markersize=4, label=name)
    errors.loglog([10, 80], [3e-3, 3e-3 / 64.0], "k--", linewidth=0.8, label="second order")
    errors.set_title("Error", fontsize=9)
    errors.set_xlabel("nodes")
    for axis in axes.ravel():
        axis.grid(alpha=0.3)
        axis.legend(fontsize=7)
    figure.tight_layout()
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=80)
    pyplot.close(figure)
