"""The paper's ten goals: rest shapes of the plant at random grips behind the three cylinders.

Cylinders are those of `scenarios/three-cylinders.toml`, the paper's three radii and heights. The
paper gives neither where its cylinders stand nor its goals. The rope begins as good as straight, at
rest between grips 0.44 m apart, and is always as the plant can be: the same grips leave the
position-based rod at another shape than the continuous one.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float64

from lariat.geometry.obstacles import Obstacle, chain_clearance
from lariat.geometry.poses import Pose
from lariat.rod import Rod, RodState
from lariat.rod.xpbd import XpbdRod
from shared.scenario import load

SCENARIO = Path(__file__).parents[2] / "scenarios" / "three-cylinders.toml"
LEVEL = np.array([0.5, 0.5, 0.5, 0.5])
"""Of both grips, always: along x from left to right."""
START = (np.array([-0.22, -0.12, 0.30]), np.array([0.22, -0.12, 0.30]))
"""Grips at the beginning [m]."""
SPARE = 0.02
"""Least distance of a goal from every obstacle, surface to surface [m]."""


@dataclass(frozen=True)
class Goal:
    """A shape to be reached, and the grips at which it is the plant's."""

    nodes: Float64[np.ndarray, "n 3"]
    """[m]"""
    left: Pose
    right: Pose


def scene() -> tuple[Obstacle, ...]:
    """The cylinders and the table."""
    return load(SCENARIO).bodies


def start(rod: Rod | XpbdRod) -> RodState:
    """The rope before it moves."""
    return rod.rest(*(Pose(p, LEVEL) for p in START)).state


def goals(rod: Rod | XpbdRod, reference: XpbdRod, count: int, seed: int) -> Iterator[Goal]:
    """Goals of one plant, at grips that are goals of the reference as well.

    Args:
        rod: The plant.
        reference: By which grips are chosen, so that every plant gets the same.
    """
    random = np.random.default_rng(seed)
    obstacles = scene()
    found = 0
    while found < count:
        half, yaw, tilt = random.uniform((0.10, -0.5, -0.2), (0.19, 0.5, 0.2))
        centre = random.uniform((-0.05, 0.08, 0.20), (0.05, 0.22, 0.32))
        chord = half * np.array([np.cos(yaw), np.sin(yaw), tilt])
        left, right = Pose(centre - chord, LEVEL), Pose(centre + chord, LEVEL)
        rest = reference.rest(left, right)
        radius = reference.properties.diameter / 2.0
        clearance = chain_clearance(rest.state.positions, radius, obstacles)
        if not rest.converged or clearance < SPARE:
            continue
        found += 1
        if rod is not reference:
            rest = rod.rest(left, right)
        yield Goal(rest.state.positions, left, right)
