"""Goals like the paper's ten: rest shapes of the plant at random grips behind three cylinders.

The cylinders are those of `scenarios/three-cylinders.toml`, with the paper's radii and heights; the
paper gives neither their positions nor its goals. The rope starts nearly straight, at rest between
grips 0.44 m apart. Start and goals are rest shapes of each plant: the same grips hold the
position-based rod in another shape than the continuous one.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from jaxtyping import Float64

from lariat.geometry.obstacles import Obstacle, chain_clearance
from lariat.geometry.poses import Pose
from lariat.paper.xpbd import XpbdRod
from lariat.rod import Rod, RodState
from lariat.scenario import load
from lariat.scenario.goal_table import LEVEL_GRIP
from lariat.scenario.shipped import find

BASE_SCENARIO = "three-cylinders"
"""Scenario of the cylinders."""
START_GRIPS = (np.array([-0.22, -0.12, 0.30]), np.array([0.22, -0.12, 0.30]))
"""Positions of the grips at the start [m]."""
MIN_CLEARANCE = 0.02
"""Least clearance of a goal [m]."""


Nodes = Float64[np.ndarray, "n 3"]
"""Node positions of a goal [m]."""


def obstacles() -> tuple[Obstacle, ...]:
    """Return the cylinders and the table."""
    return load(find(BASE_SCENARIO)).bodies


def start_state(rod: Rod | XpbdRod) -> RodState:
    """Return the rod at rest at the start."""
    return rod.rest(*(Pose(p, LEVEL_GRIP) for p in START_GRIPS)).state


def goals(rod: Rod | XpbdRod, reference: XpbdRod, seed: int) -> Iterator[Nodes]:
    """Yield goals of a plant without end."""
    random = np.random.default_rng(seed)
    bodies = obstacles()
    while True:
        half, yaw, tilt = random.uniform((0.10, -0.5, -0.2), (0.19, 0.5, 0.2))
        centre = random.uniform((-0.05, 0.08, 0.20), (0.05, 0.22, 0.32))
        chord = half * np.array([np.cos(yaw), np.sin(yaw), tilt])
        left, right = (
            Pose(centre - chord, LEVEL_GRIP),
            Pose(centre + chord, LEVEL_GRIP),
        )
        rest = reference.rest(left, right)
        radius = reference.properties.diameter / 2.0
        clearance = chain_clearance(rest.state.positions, radius, bodies)
        if not rest.converged or clearance < MIN_CLEARANCE:
            continue
        if rod is not reference:
            rest = rod.rest(left, right)
        yield rest.state.positions
