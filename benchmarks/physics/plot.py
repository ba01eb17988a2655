"""Plot of shapes and of errors over the number of nodes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from benchmarks.physics import whip, writhing
from benchmarks.physics.convergence import ROUNDING_ERROR, Convergence
from benchmarks.physics.elasticae import CLAMPED_ROPES, OTHER_ROPES

if TYPE_CHECKING:
    from matplotlib.axes import Axes

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

    panels = (
        ("Mean distance of nodes from the continuum", "[mm]", ("elasticae",)),
        ("Natural frequencies, critical loads", "error [%]", ("frequencies", "buckling")),
        ("Young's modulus from exact shapes", "error [%]", ("stiffness",)),
    )
    for place, (title, unit, names) in enumerate(panels, start=4):
        axis = figure.add_subplot(2, 3, place)
        _draw_errors(axis, {name: measured[name] for name in names if name in measured})
        axis.set_title(title, fontsize=9)
        axis.set_xlabel("nodes")
        axis.set_ylabel(unit)
    for axis in figure.axes:
        axis.grid(alpha=0.3)
        if axis.get_legend_handles_labels()[0]:
            axis.legend(fontsize=7)
    figure.tight_layout()
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=80)
    pyplot.close(figure)


def _draw_errors(axis: Axes, measured: Mapping[str, Sequence[Convergence]]) -> None:
    """Plot the errors of every case, with one color and one label for each kind of case."""
    colors: dict[str, str] = {}
    cases = [(name, found) for name, part in measured.items() for found in part]
    for name, found in cases:
        errors = [error.value for error in found.errors]
        if len(errors) < 2 or min(errors) < ROUNDING_ERROR:
            continue
        if name == "elasticae":
            kind = "two clamps" if found.case.name in CLAMPED_ROPES else "a free or pinned end"
        else:
            kind = found.case.name if name == "stiffness" else name
        label = None if kind in colors else kind
        color = colors.setdefault(kind, f"C{len(colors)}")
        axis.loglog(found.case.node_counts, errors, ".-", color=color, linewidth=0.8, label=label)
    if cases:
        counts = np.array(cases[0][1].case.node_counts, float)
        largest = max(found.errors[0].value for _, found in cases)
        axis.loglog(counts, 2.0 * largest * (counts[0] / counts) ** 2, "k--", label="second order")
        axis.loglog(counts, 2.0 * largest * counts[0] / counts, "k:", label="first order")
