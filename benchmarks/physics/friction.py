"""Friction: a rope on a slope, round a post, and over a bar.

Every case has a closed form for the load at which the rope begins to slide. The error is that of
the load at which the rod does, as found by bisection, or of its motion where it must not move.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial

import numpy as np

from benchmarks.physics.cases import Case
from lariat.geometry import Obstacle, pack, poses
from lariat.rod import Rod, RodProperties, RodState, RolloutSpec, state_along

GRAVITY, COEFFICIENT = 9.81, 0.3
"""Gravitational acceleration [m/s^2], and coefficient of friction [-]."""
POST, BAR = 0.02, 0.05
"""Radii of the post and of the bar [m]."""
THIN = RodProperties(1.0, 0.001, 0.02, 1e5, damping=1.0, contact_stiffness=1e6, contact_margin=1e-4)
"""Thin rope that hangs; its length is that of the case."""
SLIDING = 0.004
"""Motion of a rope that slides, in `HELD_STEPS` steps without inertia [m]."""
HELD_STEPS, HELD_STEP = 60, 0.05
"""Steps that tell a rope that slides from one that stays, and their duration [s]."""
ACROSS = (math.sqrt(0.5), math.sqrt(0.5), 0.0, 0.0)
"""Orientation of a cylinder along y."""


def slope_motion(
    share: float,
    node_count: int = 40,
    dt: float = 0.02,
    seconds: float = 60.0,
    damping: float = 1.0,
    across: bool = False,
) -> float:
    """Return how far a free rope on a slope has moved after some seconds [m].

    `share` is the tangent of the slope over the coefficient; a rope that lies across it rolls.
    """
    angle = math.atan(share * COEFFICIENT)
    gravity = (GRAVITY * math.sin(angle), 0.0, -GRAVITY * math.cos(angle))
    rope = RodProperties(0.4, 0.008, 0.044, 1e6, damping=damping)
    rod = Rod(rope, node_count, "free", "free", gravity)
    slope = pack([Obstacle("half_space", (0.0, 0.0, 0.0), friction=COEFFICIENT)])
    # The rope begins where the penalty of contact carries its weight.
    load = GRAVITY * math.cos(angle) * rope.linear_density
    depth = math.sqrt(2.0 * rope.contact_margin * load / rope.effective_contact_stiffness)
    height = 0.5 * rope.diameter + rope.contact_margin - depth
    start = rod.straight((0.0, 0.0, height), (0.0, 1.0, height) if across else (1.0, 0.0, height))
    spec = RolloutSpec(start, np.zeros((1, 2, 6)), dt, round(seconds / dt), obstacles=slope)
    moved = rod.rollout(spec).positions[-1] - start.positions
    return float(np.max(np.abs(moved[:, :2])))


def post_exponent(radius: float, node_count: int = 80, dt: float = 0.01) -> float:
    """Return the growth of tension per radian [-] of a rope that is drawn half way round a post."""
    lead, centre = 0.05, POST + radius
    length = math.pi * centre + 2.0 * lead
    rope = RodProperties(length, 2.0 * radius, 0.02, 2e4, damping=20.0, contact_margin=1e-4)
    rod = Rod(rope, node_count, "pinned", "pinned", (0.0, 0.0, 0.0))
    post = pack([Obstacle("cylinder", (0, 0, 0), ACROSS, POST, height=0.5, friction=COEFFICIENT)])
    actions = np.zeros((round(1.2 / dt), 2, 6))
    loading = round(0.2 / dt)
    actions[:loading, :, 2] = -0.5 * length / rope.stretch_stiffness / 0.2
    actions[loading:, :, 2] = 0.002, -0.002
    spec = RolloutSpec(_over(rod, lead, centre), actions, dt, obstacles=post)
    final = rod.rollout(spec).final
    edges = np.diff(final.positions, axis=0) / rod.edge_length
    forces = edges - poses.rotate(final.orientations, np.array([0.0, 0.0, 1.0]))
    tensions = np.linalg.norm(forces, axis=1)
    return float(math.log(tensions[-1] / tensions[0]) / math.pi)


def post_truth(radius: float, coefficient: float = COEFFICIENT, post: float = POST) -> float:
    """Return the growth of tension per radian of a rope of some thickness round a post [-]."""
    centre = post + radius
    root = math.sqrt(1.0 + 4.0 * coefficient**2 * radius * post / centre**2)
    return centre * (root - 1.0) / (2.0 * radius * coefficient)


def bar_motion(share: float, node_count: int = 80, short: float = 0.05) -> float:
    """Return how far a rope moves that hangs over a bar [m].

    `share` is the length of its long end over that at which it begins to slide.
    """
    radius = THIN.diameter / 2.0
    # The coefficient that a thin rope would need in place of this one.
    thin = post_truth(radius, COEFFICIENT, BAR)
    growth, centre = math.exp(thin * math.pi), BAR + radius
    weight = 2.0 * thin / (1.0 + thin**2) * (growth + 1.0)
    long = share * (growth * short + centre * weight)
    rope = replace(THIN, length=short + math.pi * centre + long)
    bar = Obstacle("cylinder", (0.0, 0.0, 0.0), ACROSS, BAR, height=0.5, friction=COEFFICIENT)
    rod = Rod(rope, node_count, "free", "free")
    durations, still = np.full(HELD_STEPS, HELD_STEP), np.zeros((HELD_STEPS, 2, 6))
    motion, _ = rod.settle(_over(rod, short, centre), still, durations, pack([bar]))
    # Loads come on in the first third: the rope stretches, and its slips grow.
    moved = motion.positions[-1] - motion.positions[HELD_STEPS // 3]
    return float(np.linalg.norm(moved, axis=1).max())


def _over(rod: Rod, lead: float, centre: float) -> RodState:
    """Return a rope that hangs for a length `lead` before its arc about y, and behind it."""
    s = np.linspace(0.0, rod.properties.length, rod.node_count) - lead
    angle = np.clip(s / centre, 0.0, math.pi) - 0.5 * math.pi
    hanging = np.minimum(s, 0.0) - np.maximum(s - math.pi * centre, 0.0)
    x, z = centre * np.sin(angle), centre * np.cos(angle) + hanging
    unclamped = np.array([1.0, 0.0, 0.0, 0.0])
    nodes = np.stack([x, np.zeros_like(x), z], axis=1)
    return state_along(nodes, unclamped, unclamped, rod.model.clamps)


def slope_error(dt: float, node_count: int) -> float:
    """Return the motion of a rope on a slope on which it must stay [mm]."""
    return 1e3 * slope_motion(0.97, node_count, dt)


def post_error(radius: float, dt: float, node_count: int) -> float:
    """Return the error of the growth of tension round a post [%]."""
    return 100.0 * abs(post_exponent(radius, node_count, dt) / post_truth(radius) - 1.0)


def bar_error(node_count: int) -> float:
    """Return the error of the load at which a rope over a bar begins to slide [%]."""
    low, high = 0.9, 1.1
    for _ in range(7):
        middle = 0.5 * (low + high)
        slides = bar_motion(middle, node_count) > SLIDING
        low, high = (low, middle) if slides else (middle, high)
    return abs(50.0 * (low + high) - 100.0)


CASES = tuple(
    Case(name, unit, error, (40, 80, 160), dict.fromkeys((40, 80, 160), bound))
    for name, unit, error, bound in (
        *(
            (f"slope at 0.97, {h:.0f} ms", "mm", partial(slope_error, 1e-3 * h), 1e-3)
            for h in (1.0, 5.0, 20.0)
        ),
        *(
            (f"post, {1e3 * r:g} mm, {h:.0f} ms", "%", partial(post_error, r, 1e-3 * h), 2.0)
            for r in (0.0005, 0.004)
            for h in (1.0, 5.0, 20.0)
        ),
        ("bar", "%", bar_error, 2.0),
    )
)
