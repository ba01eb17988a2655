"""Simulated motion of a rope, measured at a few vertices."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from lariat.geometry import poses
from lariat.geometry.poses import Pose
from lariat.identification import Motion, check_motion
from lariat.rod import Rod, RodProperties, RolloutSpec

STIFFNESS = 0.02
"""EI per linear density [m^4/s^2]."""
TRUE_PROPERTIES = RodProperties(
    0.7, 0.008, 0.05, 1e7, damping=0.3, internal_damping=0.03
).with_stiffness(STIFFNESS * 0.05)
CURVED_PROPERTIES = replace(TRUE_PROPERTIES, rest_curvature=((1.5, 0.0, 0.0),))
NODES = 37


def recorded(
    properties: RodProperties = TRUE_PROPERTIES,
    sequences: int = 2,
    frames: int = 120,
    right: str = "clamped",
    noise: float = 0.0,
    seed: int = 0,
    on_rope: bool = False,
) -> Motion:
    """Return the motion of a rope swung by its ends, at every fourth node.

    Clamped edges are vertices too; with `on_rope`, the outer two nodes stand for them.
    """
    random = np.random.default_rng(seed)
    rod = Rod(properties, NODES, right=right, tolerance=1e-8)
    z = np.array([0.0, 0.0, 1.0])
    left = Pose(
        np.zeros(3), poses.rotation_between(z, poses.normalized(np.array([0.3, 0.1, -1.0])))
    )
    grip = Pose(np.array([0.3, 0.0, 0.0]), poses.rotation_between(z, z))
    start = rod.rest(left, grip).state
    t = 0.01 * np.arange(frames)[:, None, None]
    sequences_of_vertices = []
    for _ in range(sequences):
        phase = random.uniform(0.0, 2.0 * np.pi, (3, 2, 6))
        size = np.array([0.35, 0.35, 0.35, 0.6, 0.6, 0.0])
        pace = random.uniform(3.0, 9.0, (3, 2, 6))
        actions = np.sum(size / 2.0 * np.sin(pace * t[..., None, :, :] + phase), axis=-3)
        actions = actions.reshape(frames, 2, 6)
        # The motion begins smoothly, as recorded ones do.
        actions = actions * np.minimum(1.0, t / 0.2)
        nodes = rod.rollout(RolloutSpec(start, actions, 0.01, substeps=4)).positions
        middles = 0.5 * (nodes[:, 1:] + nodes[:, :-1])
        inner = nodes[:, 4:-3:4]
        ends = [middles[:, -1:], nodes[:, -1:]] if right == "clamped" else [nodes[:, -1:]]
        sequences_of_vertices.append(
            nodes[:, ::4]
            if on_rope
            else np.concatenate([nodes[:, :1], middles[:, :1], inner, *ends], axis=1)
        )
    vertices = np.array(sequences_of_vertices)
    vertices += noise * random.normal(size=vertices.shape)
    count = vertices.shape[2]
    held = [0, 1, count - 2, count - 1] if right == "clamped" else [0, 1]
    return check_motion(vertices, 0.01, np.array(held))
