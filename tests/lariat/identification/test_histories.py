"""Friction and set are identified from motion that shows them, and stated as unknown from others.

Cables that yield are rigid links in MuJoCo; ropes that are drawn along a table, rods of another n.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from lariat.geometry import pack, poses
from lariat.geometry.obstacles import TABLE
from lariat.geometry.poses import Pose
from lariat.identification import Finding, Motion, check_motion, findings, generic_rope, identify
from lariat.rod import Rod, RodProperties, RolloutSpec
from lariat.simulation.plants.end_motion import EndMotion
from lariat.simulation.plants.linked_rope import LinkedRope
from lariat.simulation.plants.mujoco_plant import MujocoPlant
from lariat.simulation.plants.mujoco_rope import MujocoRope

NODES = 33
STEP = 0.02
CABLE = RodProperties(0.5, 0.008, 0.05, 1e7, yield_curvature=4.0).with_stiffness(1e-3)
NOISE = 3e-4


def recorded(
    properties: RodProperties,
    velocities: np.ndarray,
    height: float,
    apart: float = 0.49,
) -> Motion:
    """Return every fourth node of links that lie or hang between grips with given velocities."""
    layers = tuple((share, limit) for share, limit, _ in properties.layers.tolist())
    rope = MujocoRope(
        properties.length,
        properties.diameter,
        NODES,
        properties.linear_density,
        properties.youngs_modulus,
        damping=properties.damping,
        internal_damping=0.02,
        layers=layers,
    )
    plant = MujocoPlant(LinkedRope(rope), [TABLE], timestep=0.001)
    along = poses.rotation_between(np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0]))
    places = np.array([[-0.5 * apart, 0.0, height], [0.5 * apart, 0.0, height]])
    plant.reset(*(Pose(place, along) for place in places))
    frames = []
    for velocity in velocities:
        nodes = plant.nodes
        middles = 0.5 * (nodes[[0, -2]] + nodes[[1, -1]])
        frames.append([nodes[0], middles[0], *nodes[4:-3:4], middles[1], nodes[-1]])
        places = places + STEP * velocity
        plant.step(
            *(EndMotion(Pose(p, along), v) for p, v in zip(places, velocity, strict=True)), STEP
        )
    vertices = np.array([frames])
    vertices += NOISE * np.random.default_rng(0).normal(size=vertices.shape)
    return check_motion(vertices, STEP, [0, 1, -2, -1])


def named(motion: Motion, start: RodProperties, name: str) -> Finding:
    return next(f for f in findings(identify(motion, start)) if f.name == name)


def there_and_back(distance: float, frames: int = 100) -> np.ndarray:
    """Velocities of grips that come together along x, and part again."""
    t = (np.arange(frames) + 0.5) / frames
    velocity = 0.5 * distance * math.pi / (frames * STEP) * np.sin(2.0 * math.pi * t)
    return velocity[:, None, None] * np.array([[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]])


def test_yield_curvature_is_found_from_a_cable_that_keeps_a_bend() -> None:
    motion = recorded(CABLE, there_and_back(0.3), 0.4)
    found = named(motion, replace(generic_rope(), yield_curvature=8.0), "yield_curvature")
    assert found.known
    assert abs(found.value - 4.0) < 3.0 * found.standard_deviation < 4.0


def test_yield_curvature_of_a_cable_that_springs_back_is_unknown() -> None:
    motion = recorded(CABLE, there_and_back(0.02), 0.4, apart=0.495)
    found = named(motion, replace(generic_rope(), yield_curvature=8.0), "yield_curvature")
    assert not found.known


def drawn(height: float, frames: int = 100) -> Motion:
    """Return every eighth node of a rope of another n that grips draw aside, together and back."""
    rope = replace(CABLE, yield_curvature=math.inf, internal_damping=0.02)
    rod = Rod(rope, 65)
    along = poses.rotation_between(np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0]))
    grips = (Pose(np.array([x, 0.0, height]), along) for x in (-0.21, 0.21))
    table = pack([replace(TABLE, friction=0.3, support=True)])
    t = (np.arange(frames) + 0.5) / frames
    actions = np.zeros((frames, 2, 6))
    actions[:, :, 1] = 0.3 * np.sin(2.0 * math.pi * t)[:, None]
    actions[:, 0, 0] = 0.12 * np.sin(4.0 * math.pi * t)
    actions[:, :, 2] = 0.03 * np.sin(6.0 * math.pi * t)[:, None]
    actions *= np.minimum(1.0, 10.0 * t)[:, None, None]
    state = rod.rest(*grips, obstacles=table).state
    nodes = rod.rollout(RolloutSpec(state, actions, STEP, substeps=4, obstacles=table)).positions
    middles = 0.5 * (nodes[:, [0, -2]] + nodes[:, [1, -1]])
    vertices = np.concatenate(
        [nodes[:, :1], middles[:, :1], nodes[:, 8:-7:8], middles[:, 1:], nodes[:, -1:]], axis=1
    )[None]
    vertices += NOISE * np.random.default_rng(0).normal(size=vertices.shape)
    return check_motion(vertices, STEP, [0, 1, -2, -1])


def test_friction_is_found_from_a_rope_drawn_along_a_table_alone() -> None:
    table = pack([replace(TABLE, friction=0.15)])
    for height, known in ((0.03, True), (0.4, False)):
        motion = replace(drawn(height), bodies=table)
        found = named(motion, generic_rope(), "friction_factor")
        assert found.known == known
        if known:
            assert abs(found.value - 2.0) < max(3.0 * found.standard_deviation, 0.1)
