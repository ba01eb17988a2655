"""Plot of shapes and of errors over the number of nodes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from benchmarks.physics import whip, writhing
from benchmarks.physics.convergence import ROUNDING_ERROR, Convergence
from benchmarks.physics.elasticae import CLAMPED_ROPES, OTHER_ROPES

COARSE_COUNT, FINE_COUNT = 20, 400
"""Number of nodes of the plotted rods, and number of points of the continuum."""
SHAPES = ("0.24 m apart", "E / 4", "E x 4", "pitched", "cantilever, E x 2")
"""Plotted ropes, all in the plane y = 0."""
WHIP_NODES, WHIP_FRAMES = 80, 14
"""Number of nodes of the plotted whip, and number of its shapes."""


def draw(measured: Mapping[str, Sequence[Convergence]], path: Path) -> None:
    """Write a plot of hanging ropes, a loop, a whip, and the errors of every part.

    Args:
        measured: Parts of `lariat bench physics` by name.
        path: File to write, a PNG.
    """
    import matplotlib

    matplotlib.use("agg")
    from matplotlib import colormaps, pyplot

    figure = pyplot.figure(figsize=(13, 8))
    hanging = figure.add_subplot(2, 3, 1)
    ropes = CLAMPED_ROPES | OTHER_ROPES
    for k, name in enumerate(SHAPES):
        exact = ropes[name].continuum.positions(FINE_COUNT)
        nodes = ropes[name].rest(COARSE_COUNT).state.positions
        hanging.plot(exact[:, 0], exact[:, 2], color=f"C{k}", linewidth=1.0, label=name)
        hanging.plot(nodes[:, 0], nodes[:, 2], "o", color=f"C{k}", markersize=3)
    hanging.set_title(f"Continuum (lines), rods of {COARSE_COUNT} nodes", fontsize=9)
    hanging.set_aspect("equal", "datalim")

    loop = figure.add_subplot(2, 3, 2)
    states = writhing.closing_states(writhing.LOOP_NODES)
    for k, index in enumerate((0, len(states) // 2, len(states) - 1)):
        nodes = states[index].positions
        # A view from above and from the side at once separates the strands.
        loop.plot(nodes[:, 0], nodes[:, 1] + 0.35 * nodes[:, 2] - 0.2 * k, color=f"C{k}")
    loop.set_title(
        f"A rod with {writhing.LOOP_TURNS:.0f} turns of twist, its ends brought together",
        fontsize=9,
    )
    loop.set_aspect("equal", "datalim")

    crack = whip.flick(WHIP_NODES)
    lash = figure.add_subplot(2, 3, 3)
    frames = np.linspace(0, len(crack.positions) - 1, WHIP_FRAMES).astype(int)
    for k, frame in enumerate(frames):
        nodes = crack.positions[frame]
        lash.plot(nodes[:, 0], nodes[:, 2], color=colormaps["viridis"](k / WHIP_FRAMES))
    lash.set_title(
        f"A whip of {whip.WHIP.length} m, tip up to {crack.tip_speeds.max():.1f} m/s", fontsize=9
    )
    lash.set_aspect("equal", "datalim")
    for axis in (hanging, loop, lash):
        axis.set_xlabel("x [m]")

    parts = [
        ("Mean distance of nodes from the continuum", ("elasticae",), "[mm]"),
        ("Natural frequencies and critical loads", ("frequencies", "buckling"), "error [%]"),
        ("Young's modulus from exact shapes", ("stiffness",), "error [%]"),
    ]
    for place, (title, names, unit) in enumerate(parts, start=4):
        axis = figure.add_subplot(2, 3, place)
        cases = [found for name in names for found in measured.get(name, ())]
        for k, found in enumerate(cases):
            errors = [error.value for error in found.errors]
            if len(errors) > 1 and min(errors) > ROUNDING_ERROR:
                style = "-" if k < 10 else "--"
                axis.loglog(
                    found.case.node_counts, errors, style, marker=".", label=found.case.name
                )
        if cases:
            counts = np.array(cases[0].case.node_counts, float)
            start = max(error.value for found in cases for error in found.errors)
            axis.loglog(counts, start * (counts[0] / counts) ** 2, "k:", label="second order")
        axis.set_title(title, fontsize=9)
        axis.set_xlabel("nodes")
        axis.set_ylabel(unit)
    for axis in figure.axes:
        axis.grid(alpha=0.3)
        if axis.get_legend_handles_labels()[0]:
            axis.legend(fontsize=5.5)
    figure.tight_layout()
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=80)
    pyplot.close(figure)
