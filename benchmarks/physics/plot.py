"""Pictures of ropes at rest and of ropes that begin to slide."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path

import numpy as np

from benchmarks.campaign import Trial
from benchmarks.physics import friction
from benchmarks.physics.hanging import CLAMPED_ROPES, OTHER_ROPES
from benchmarks.plots import figure_of, save

SHAPES = ("0.24 m apart", "E / 4", "E x 4", "pitched", "cantilever, E x 2")
"""Plotted ropes, all in the plane y = 0."""


def draw_ropes(trials: Sequence[Trial], path: Path) -> None:
    """Draw hanging ropes beside the continuum, and the errors of all cases, to a PNG."""
    figure, (hanging, errors) = figure_of(1, 2, (11.0, 4.5))
    for k, name in enumerate(SHAPES):
        rope = (CLAMPED_ROPES | OTHER_ROPES)[name]
        exact, nodes = rope.continuum.positions(400), rope.rest(20).state.positions
        hanging.plot(exact[:, 0], exact[:, 2], color=f"C{k}", linewidth=1.0, label=name)
        hanging.plot(nodes[:, 0], nodes[:, 2], "o", color=f"C{k}", markersize=3)
    hanging.set(xlabel="x [m]", ylabel="z [m]", aspect="equal", adjustable="datalim")
    hanging.set_title("Continuum (lines), rods of 20 nodes", fontsize=9)
    for trial in trials:
        errors.loglog(trial["spec"].case.node_counts, trial["errors"], ".-", linewidth=0.8)
    counts = np.array(trials[0]["spec"].case.node_counts, float)
    largest = max(trial["errors"][0] for trial in trials)
    errors.loglog(counts, 2.0 * largest * (counts[0] / counts) ** 2, "k--", label="2nd order")
    errors.set(xlabel="nodes", ylabel="[mm]")
    errors.set_title("Mean distance of nodes from the continuum", fontsize=9)
    save(figure, path)


def draw_friction(path: Path) -> None:
    """Draw ropes that begin to slide on a slope, round a post, over a bar and an edge, to a PNG."""
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
    slope.set_title("Rope along a slope", fontsize=9)
    post.set_title(f"Rope round a post of {1e3 * friction.POST:g} mm", fontsize=9)
    hanging.set_title("Hanging ropes, n = 80", fontsize=9)
    save(figure, path)
