"""Plot of shapes and of errors over the number of nodes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.physics import friction, whip, writhing
from benchmarks.physics.convergence import ROUNDING_ERROR, Convergence
from benchmarks.physics.elasticae import CLAMPED_ROPES, OTHER_ROPES
from benchmarks.plots import figure_of, save

COARSE_COUNT, FINE_COUNT = 20, 400
"""Number of nodes of the plotted rods, and number of points of the continuum."""
SHAPES = ("0.24 m apart", "E / 4", "E x 4", "pitched", "cantilever, E x 2")
"""Plotted ropes, all in the plane y = 0."""
WHIP_NODES, WHIP_FRAMES = 80, 14
"""Number of nodes of the plotted whip, and number of its shapes."""
PANELS = (
    ("Mean distance of nodes from the continuum", "[mm]", ("elasticae",)),
    ("Natural frequencies, critical loads", "error [%]", ("frequencies", "buckling")),
    ("Young's modulus from exact shapes", "error [%]", ("stiffness",)),
)
"""Title, unit and parts of the panels of errors."""


def draw(measured: Mapping[Any, Sequence[Convergence]], path: Path) -> None:
    """Write a plot of hanging ropes, a loop, a whip, and the errors of every part.

    Args:
        measured: Parts of `lariat bench physics` by name.
        path: File to write, a PNG.
    """
    figure, ((hanging, loop, lash), panels) = figure_of(2, 3, (13.0, 8.0))
    ropes = CLAMPED_ROPES | OTHER_ROPES
    for k, name in enumerate(SHAPES):
        exact = ropes[name].continuum.positions(FINE_COUNT)
        nodes = ropes[name].rest(COARSE_COUNT).state.positions
        hanging.plot(exact[:, 0], exact[:, 2], color=f"C{k}", linewidth=1.0, label=name)
        hanging.plot(nodes[:, 0], nodes[:, 2], "o", color=f"C{k}", markersize=3)
    hanging.set_title(f"Continuum (lines), rods of {COARSE_COUNT} nodes", fontsize=9)
    states = writhing.closing_states(writhing.LOOP_NODES)
    for k, index in enumerate((0, len(states) // 2, len(states) - 1)):
        nodes = states[index].positions
        # A view from above and from the side at once separates the strands.
        loop.plot(nodes[:, 0], nodes[:, 1] + 0.35 * nodes[:, 2] - 0.2 * k, color=f"C{k}")
    loop.set_title(f"{writhing.LOOP_TURNS:.0f} turns, ends brought together", fontsize=9)
    crack = whip.flick(WHIP_NODES)
    for frame in np.linspace(0, len(crack.positions) - 1, WHIP_FRAMES).astype(int):
        shade = str(0.8 - 0.8 * frame / len(crack.positions))
        lash.plot(crack.positions[frame][:, 0], crack.positions[frame][:, 2], color=shade)
    speed = crack.tip_speeds.max()
    lash.set_title(f"A whip of {whip.WHIP.length} m, tip up to {speed:.1f} m/s", fontsize=9)
    for axis in (hanging, loop, lash):
        axis.set(xlabel="x [m]", aspect="equal", adjustable="datalim")
    for axis, (title, unit, parts) in zip(panels, PANELS, strict=True):
        for part in parts:
            _draw_errors(axis, part, measured.get(part, ()))
        axis.set(xlabel="nodes", ylabel=unit)
        axis.set_title(title, fontsize=9)
    save(figure, path)


def draw_friction(path: Path) -> None:
    """Write a plot of ropes that begin to slide: on a slope, round a post, over a bar and an edge.

    Args:
        path: File to write, a PNG.
    """
    figure, (slope, post, hanging) = figure_of(1, 3, (13.0, 4.0))
    shares = np.linspace(0.8, 1.2, 21)
    moved = [1e3 * friction.slope_motion(share, seconds=1.0, dt=0.01) for share in shares]
    slope.semilogy(shares, moved, ".-")
    slope.set(xlabel="tan(slope) / coefficient", ylabel="motion in 1 s [mm]")
    radii = np.linspace(5e-4, 5e-3, 40)
    post.plot(1e3 * radii, [friction.post_truth(r) for r in radii], label="closed form")
    exponents = [friction.post_exponent(r) for r in radii[::6]]
    post.plot(1e3 * radii[::6], exponents, "o", label="rod of 80 nodes")
    post.axhline(friction.COEFFICIENT, color="k", linestyle="--", label="thin rope")
    post.set(xlabel="radius of the rope [mm]", ylabel="growth of tension per radian")
    for name, motion in (
        ("bar", friction.bar_motion),
        ("rough edge", friction.edge_motion),
        ("smooth edge", partial(friction.edge_motion, rough=False)),
    ):
        moved = [1e3 * motion(share) for share in shares[5:16]]
        hanging.semilogy(shares[5:16], moved, ".-", label=name)
    hanging.set(xlabel="load / closed form", ylabel="motion [mm]")
    for axis, title in (
        (slope, "Rope along a slope"),
        (post, f"Rope round a post of {1e3 * friction.POST:g} mm"),
        (hanging, "Hanging ropes, n = 80"),
    ):
        axis.set_title(title, fontsize=9)
    save(figure, path)


def _draw_errors(axis: Any, part: str, cases: Sequence[Convergence]) -> None:
    """Plot the errors of every case, and of an error of second order."""
    for found in cases:
        errors = [error.value for error in found.errors]
        if len(errors) > 1 and min(errors) >= ROUNDING_ERROR:
            label = found.case.name if part == "stiffness" else None
            axis.loglog(found.case.node_counts, errors, ".-", linewidth=0.8, label=label)
    if cases:
        counts = np.array(cases[0].case.node_counts, float)
        largest = max(found.errors[0].value for found in cases)
        axis.loglog(counts, 2.0 * largest * (counts[0] / counts) ** 2, "k--", label="2nd order")
