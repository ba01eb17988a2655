"""Simulated true ropes at rest, against the equilibrium of the continuum, and their cost.

Every plant of `plant.model` hangs between the same grips as the rods of `elasticae`; the error is
the distance between its nodes and points of the continuum at equal arc length. The cost is the
processor time while a grip swings, without camera.
"""

from __future__ import annotations

import time
from functools import partial
from typing import Literal

import numpy as np

from benchmarks.physics.convergence import Case, Error
from benchmarks.physics.elasticae import CLAMPED_ROPES, HeldRope
from lariat.geometry.poses import Pose
from lariat.simulation.plants.end_motion import EndMotion
from lariat.simulation.plants.flex_rope import FlexRope
from lariat.simulation.plants.linked_rope import LinkedRope
from lariat.simulation.plants.mujoco_plant import MujocoPlant
from lariat.simulation.plants.mujoco_rope import MujocoRope
from lariat.simulation.plants.plant import Plant
from lariat.simulation.plants.rod_plant import RodPlant

Model = Literal["rod", "mujoco", "links"]
NODE_COUNTS = (40, 80, 120, 160)
"""Numbers of nodes of the plants."""
FINE_NODES = 120
"""Number of nodes at which the error is bounded."""
MAX_MEAN_ERROR = 0.1
"""Largest allowed mean error at `FINE_NODES` nodes [mm]."""
ROPES = ("0.24 m apart", "E / 4", "E x 4", "0.42 m apart", "pitched", "yawed", "twisted by 2.5 rad")
"""Names of the ropes."""
SWING_STEP, SWING_STEPS = 0.01, 50
"""Duration of a step [s], and number of steps, of the motion whose cost is measured."""
SWING = 0.08
"""Amplitude of that motion, one period in all its steps [m]."""


def build(model: Model, rope: HeldRope, node_count: int) -> Plant:
    """Return a plant that is at rest between the grips of a rope."""
    p = rope.properties
    if model == "rod":
        plant = RodPlant(p, node_count)
    else:
        true = MujocoRope(
            p.length,
            p.diameter,
            node_count,
            p.linear_density,
            p.youngs_modulus,
            p.poisson_ratio,
            p.damping,
        )
        plant = MujocoPlant(FlexRope(true) if model == "mujoco" else LinkedRope(true))
    plant.reset(*rope.grips)
    return plant


def error(model: Model, rope: HeldRope, node_count: int) -> Error:
    """Return mean and largest distance of a plant's nodes from the continuum [mm]."""
    nodes = build(model, rope, node_count).nodes
    distances = 1e3 * np.linalg.norm(nodes - rope.continuum.positions(node_count), axis=1)
    return Error(float(distances.mean()), float(distances.max()))


def cost(model: Model, rope: HeldRope, node_count: int) -> Error:
    """Return the processor time of a plant relative to the simulated time [%]."""
    plant = build(model, rope, node_count)
    left, right = rope.grips
    rate = 2.0 * np.pi / (SWING_STEP * SWING_STEPS)
    begin = time.process_time()
    for k in range(1, SWING_STEPS + 1):
        phase = rate * SWING_STEP * k
        across = np.array([0.0, SWING, 0.0])
        there = Pose(right.position + np.sin(phase) * across, right.orientation)
        plant.step(EndMotion(left), EndMotion(there, rate * np.cos(phase) * across), SWING_STEP)
    return Error(100.0 * (time.process_time() - begin) / (SWING_STEP * SWING_STEPS))


MODELS: tuple[Model, ...] = ("rod", "mujoco", "links")
"""Names of the plants."""
CASES: tuple[Case, ...] = (
    *(
        Case(
            f"{model}, {name}",
            "mm",
            partial(error, model, CLAMPED_ROPES[name]),
            NODE_COUNTS,
            {FINE_NODES: MAX_MEAN_ERROR},
        )
        for model in MODELS
        for name in ROPES
    ),
    *(
        Case(f"{model}, cost", "% time", partial(cost, model, HeldRope()), NODE_COUNTS)
        for model in MODELS
    ),
)
"""Cases of the table."""
