"""Random rods of any size and stiffness, with yanked ends and an obstacle in the middle."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64

from benchmarks.campaign import Workers, compute
from lariat.geometry import polylines, poses
from lariat.geometry.obstacles import Obstacle, chain_clearance, pack, signed_distance
from lariat.rod import Rod, RodProperties, RolloutSpec, state_along

ROD_LENGTH, ROD_DIAMETER = 0.5, 0.008
"""Length and diameter of the rods [m]."""
STEP_COUNT, TIME_STEP = 30, 0.01
"""Number of steps, and time step [s]."""
YANK_SPEED = 5.0
"""Speed of the yanked ends [m/s]."""
MAX_STRETCH = 0.02
"""Largest relative change of length of a good result [-]."""
MIN_CLEARANCE = -1e-3
"""Least clearance of a good result; negative in contact [m]."""


@dataclass(frozen=True)
class HardCase:
    """Rod, start, motion of its ends, and obstacles."""

    rod: Rod
    nodes: Float64[np.ndarray, "n 3"]
    """Node positions at the start [m]."""
    actions: Float64[np.ndarray, "K 2 6"]
    """Velocities of the ends [m/s, rad/s]."""
    obstacles: tuple[Obstacle, ...]


def measure(count: int, workers: Workers = 1) -> dict[str, float]:
    """Run random cases and count those that ended well, gave up, or silently went wrong."""
    results = [result for _, result in compute(run_case, range(count), workers)]
    good = [
        r["finite"] and abs(r["stretch"]) < MAX_STRETCH and r["clearance"] > MIN_CLEARANCE
        for r in results
    ]
    return {
        "cases": count,
        "finite": sum(r["finite"] for r in results),
        "good": sum(good),
        "gave_up": sum(r["gave_up"] for r in results),
        "silently_wrong": sum(
            not ended_well and not r["gave_up"] for ended_well, r in zip(good, results, strict=True)
        ),
        "largest_stretch": max(abs(r["stretch"]) for r in results),
        "least_clearance_m": min(r["clearance"] for r in results),
    }


def run_case(seed: int) -> dict[str, float]:
    """Roll out a random case; return its change of length [-] and clearance [m] at the end."""
    case = sample_case(seed)
    straight = poses.rotation_between(np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0]))
    state = state_along(case.nodes, straight, straight)
    spec = RolloutSpec(state, case.actions, TIME_STEP, obstacles=pack(case.obstacles))
    rollout = case.rod.rollout(spec)
    last = rollout.positions[-1]
    return {
        "finite": bool(np.all(np.isfinite(rollout.positions))),
        "gave_up": rollout.failure is not None,
        "stretch": polylines.length(last) / ROD_LENGTH - 1.0,
        "clearance": chain_clearance(last, ROD_DIAMETER / 2.0, case.obstacles),
    }


def sample_case(seed: int) -> HardCase:
    """Return a random case whose grips stay within reach of each other and outside obstacles."""
    rng = np.random.default_rng(seed)
    n = int(np.exp(rng.uniform(np.log(5), np.log(401))))
    modulus = 10.0 ** rng.uniform(4.0, 10.0)
    # A rod that is stiff in bending must be stiff in stretch, or it would shorten when bent.
    stretch = max(2000.0, modulus * np.pi * ROD_DIAMETER**2 / 4.0)
    rod = Rod(RodProperties(ROD_LENGTH, ROD_DIAMETER, 0.05, modulus, stretch_stiffness=stretch), n)
    while True:
        span = rng.uniform(0.4, 0.9) * ROD_LENGTH
        s = np.linspace(0.0, 1.0, 400)
        sag = sagging_curve(span, s)
        nodes = polylines.resample(sag, n)
        middle = nodes[int(rng.uniform(0.35, 0.65) * n)]
        shape = rng.choice(["sphere", "box", "capsule", "cylinder"])
        turn = tuple(poses.normalized(rng.normal(size=4)))
        # Centred on the rod: the deepest possible overlap.
        body = Obstacle(
            str(shape), tuple(middle), turn, size=(0.06, 0.06, 0.06), radius=0.03, height=0.08
        )
        actions = yank_actions(rng, span)
        if actions is None:
            continue
        # Grips must not be in the obstacle either, or the rod cannot leave it.
        ends = nodes[[0, -1]]
        path = np.concatenate([ends[None], ends + np.cumsum(TIME_STEP * actions[:, :, :3], axis=0)])
        if np.min(signed_distance(path.reshape(-1, 3), body)) > 2.0 * ROD_DIAMETER:
            return HardCase(rod, nodes, actions, (body,))


def sagging_curve(span: float, s: Float64[np.ndarray, "k"]) -> Float64[np.ndarray, "k 3"]:
    """Curve as long as the rod that sags between two points, at parameters s from 0 to 1."""

    def curve(depth: float) -> Float64[np.ndarray, "k 3"]:
        sag = depth * (16.0 * s**2 * (1.0 - s) ** 2)
        return np.stack([span * (s - 0.5), 0.0 * s, 1.0 - sag], axis=1)

    low, high = 0.0, 2.0 * ROD_LENGTH
    for _ in range(50):
        depth = 0.5 * (low + high)
        low, high = (depth, high) if polylines.length(curve(depth)) < ROD_LENGTH else (low, depth)
    return curve(low)


def yank_actions(rng: np.random.Generator, span: float) -> Float64[np.ndarray, "K 2 6"] | None:
    """Return actions that move both ends back and forth at full speed, then hold them.

    None if the ends would come too close or too far apart.
    """
    actions = np.zeros((STEP_COUNT, 2, 6))
    strokes = int(rng.integers(2, 6))
    for end in range(2):
        velocity = YANK_SPEED * poses.normalized(rng.normal(size=3))
        spin = rng.normal(size=3)
        actions[:strokes, end] = np.concatenate([velocity, spin])
        actions[strokes : 2 * strokes, end] = np.concatenate([-velocity, spin])
    separation = np.cumsum(TIME_STEP * (actions[:, 1, :3] - actions[:, 0, :3]), axis=0)
    far = np.linalg.norm(separation + np.array([span, 0.0, 0.0]), axis=1)
    return actions if far.min() > 0.05 * ROD_LENGTH and far.max() < 0.92 * ROD_LENGTH else None
