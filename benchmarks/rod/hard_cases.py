"""Rods in trouble: every size and stiffness, yanked ends, a start deep inside an obstacle."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64

from lariat.geometry import polylines, poses
from lariat.geometry.obstacles import Obstacle, chain_clearance, pack, signed_distance
from lariat.rod import Rod, RodProperties, RolloutSpec, framed

LENGTH, DIAMETER = 0.5, 0.008
STEPS, DT = 30, 0.01
SPEED = 5.0
"""Of the yanked ends [m/s]."""
LONGER = 0.02
"""Change of length that still counts as none [-]."""
DEEPER = -1e-3
"""Overlap with an obstacle that still counts as touching [m]."""


@dataclass(frozen=True)
class Case:
    """One start with what is done to it."""

    rod: Rod
    nodes: Float64[np.ndarray, "n 3"]
    actions: Float64[np.ndarray, "K 2 6"]
    obstacles: tuple[Obstacle, ...]


@dataclass(frozen=True)
class Outcome:
    """How it went."""

    finite: bool
    gave_up: bool
    stretch: float
    """Relative change of length at the end [-]."""
    clearance: float
    """Between surfaces at the end [m]."""

    @property
    def good(self) -> bool:
        """Finite, in length and out of obstacles."""
        return self.finite and abs(self.stretch) < LONGER and self.clearance > DEEPER


def drawn(seed: int) -> Case:
    """A random case; the grips stay within reach of each other and outside the obstacles."""
    rng = np.random.default_rng(seed)
    n = int(np.exp(rng.uniform(np.log(5), np.log(401))))
    modulus = 10.0 ** rng.uniform(4.0, 10.0)
    # A stiff rod is as stiff in stretch, or bending alone would shorten it.
    stretch = max(2000.0, modulus * np.pi * DIAMETER**2 / 4.0)
    rod = Rod(RodProperties(LENGTH, DIAMETER, 0.05, modulus, stretch_stiffness=stretch), n)
    while True:
        span = rng.uniform(0.4, 0.9) * LENGTH
        s = np.linspace(0.0, 1.0, 400)
        sag = polylines_of_length(span, s)
        nodes = polylines.resample(sag, n)
        middle = nodes[int(rng.uniform(0.35, 0.65) * n)]
        shape = rng.choice(["sphere", "box", "capsule", "cylinder"])
        turn = tuple(poses.normalized(rng.normal(size=4)))
        # Its middle lies on the rod: as deep as can be.
        body = Obstacle(
            str(shape), tuple(middle), turn, size=(0.06, 0.06, 0.06), radius=0.03, height=0.08
        )
        actions = yanked(rng, span)
        if actions is None:
            continue
        # Grips hold edges: those must not be in the obstacle either, or nothing can get out.
        paths = np.cumsum(DT * actions[:, :, :3], axis=0)[:, :, None] + nodes[[[0, 1], [-1, -2]]]
        held = np.concatenate([paths.reshape(-1, 3), nodes[[0, 1, -1, -2]]])
        if np.min(signed_distance(held, body)) > 2.0 * DIAMETER:
            return Case(rod, nodes, actions, (body,))


def polylines_of_length(span: float, s: Float64[np.ndarray, "k"]) -> Float64[np.ndarray, "k 3"]:
    """A curve that sags between two points, as long as the rod."""

    def curve(depth: float) -> Float64[np.ndarray, "k 3"]:
        sag = depth * (16.0 * s**2 * (1.0 - s) ** 2)
        return np.stack([span * (s - 0.5), 0.0 * s, 1.0 - sag], axis=1)

    low, high = 0.0, 2.0 * LENGTH
    for _ in range(50):
        depth = 0.5 * (low + high)
        low, high = (depth, high) if polylines.length(curve(depth)) < LENGTH else (low, depth)
    return curve(low)


def yanked(rng: np.random.Generator, span: float) -> Float64[np.ndarray, "K 2 6"] | None:
    """Both ends there and back at full speed, then still; None where they leave each other."""
    actions = np.zeros((STEPS, 2, 6))
    strokes = int(rng.integers(2, 6))
    for end in range(2):
        way = SPEED * poses.normalized(rng.normal(size=3))
        spin = rng.normal(size=3)
        actions[:strokes, end] = np.concatenate([way, spin])
        actions[strokes : 2 * strokes, end] = np.concatenate([-way, spin])
    apart = np.cumsum(DT * (actions[:, 1, :3] - actions[:, 0, :3]), axis=0)
    far = np.linalg.norm(apart + np.array([span, 0.0, 0.0]), axis=1)
    return actions if far.min() > 0.05 * LENGTH and far.max() < 0.92 * LENGTH else None


def outcome(case: Case) -> Outcome:
    """Run it."""
    straight = poses.rotation_between(np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0]))
    state = framed(case.nodes, straight, straight)
    spec = RolloutSpec(state, case.actions, DT, obstacles=pack(case.obstacles))
    rollout = case.rod.rollout(spec)
    last = rollout.positions[-1]
    return Outcome(
        bool(np.all(np.isfinite(rollout.positions))),
        rollout.failure is not None,
        polylines.length(last) / LENGTH - 1.0,
        chain_clearance(last, DIAMETER / 2.0, case.obstacles),
    )


def measured(count: int, told: Callable[[int], None] = lambda done: None) -> dict[str, float]:
    """How many of `count` cases ended well, gave up, or went wrong without saying so."""
    outcomes = []
    for seed in range(count):
        outcomes.append(outcome(drawn(seed)))
        told(seed + 1)
    silent = [o for o in outcomes if not o.good and not o.gave_up]
    return {
        "cases": count,
        "finite": sum(o.finite for o in outcomes),
        "good": sum(o.good for o in outcomes),
        "gave_up": sum(o.gave_up for o in outcomes),
        "silently_wrong": len(silent),
        "largest_stretch": max(abs(o.stretch) for o in outcomes),
        "least_clearance_m": min(o.clearance for o in outcomes),
    }
