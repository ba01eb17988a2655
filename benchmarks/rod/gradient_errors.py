"""Adjoint gradients against fourth-order finite differences of the roll-out, in contact."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from jaxtyping import Float64

from lariat.geometry import poses
from lariat.geometry.obstacles import TABLE, Obstacle, pack
from lariat.rod import PARAMETERS, Rod, RodProperties, RodState, RolloutSpec

PROPERTIES = RodProperties(
    0.45,
    0.008,
    0.044,
    1e6,
    internal_damping=0.004,
    rest_curvature=((1.0, 0.5, 0.3),),
)
"""Properties of the rod."""
LYING_ORIENTATION = (0.7071067811865476, 0.7071067811865476, 0.0, 0.0)
"""Orientation of a cylinder that lies along y, wxyz."""
OBSTACLES = pack(
    [Obstacle("cylinder", (0.0, 0.0, 0.25), LYING_ORIENTATION, radius=0.03, height=0.2), TABLE]
)
"""Bar and table, packed."""
TIME_STEP, STEP_COUNT = 0.01, 5
"""Time step [s] and number of steps."""
STATE_PARTS = {"positions": 1e-6, "velocities": 1e-4, "angular_velocities": 1e-1, "rotations": 1e-4}
"""Parts of the state, and the step of their finite differences."""


def rows() -> list[dict[str, float]]:
    """Return the relative errors of the gradients of rods, in norm [-]."""
    return [measure(n, tolerance) for tolerance in (1e-10, 1e-7) for n in (10, 40, 100)]


def measure(node_count: int, tolerance: float) -> dict[str, float]:
    """Return the errors of one rod, whose solver has a tolerance [m]; the differences' has 1e-12.

    `parameters` is the error of the gradient in all parameters, each scaled by its value.
    """
    rng = np.random.default_rng(node_count)
    fine = Rod(PROPERTIES, node_count, tolerance=1e-12)
    moves = np.zeros((8, 2, 6))
    moves[:, 1] = [-1.2, 0.0, 0.0, 2.0, 0.0, 2.0]
    moves[:, 0] = [0.0, 0.3, 0.0, 0.0, 1.0, 0.0]
    start = fine.straight([-0.225, 0.0, 0.3], [0.225, 0.0, 0.3])
    state = fine.rollout(RolloutSpec(start, moves, TIME_STEP, obstacles=OBSTACLES)).final
    actions = 0.5 * rng.normal(size=(STEP_COUNT, 2, 6))
    slope = rng.normal(size=(STEP_COUNT, node_count, 3))

    def cost(
        actions: Float64[np.ndarray, "K 2 6"] = actions, state: RodState = state, rod: Rod = fine
    ) -> float:
        spec = RolloutSpec(state, actions, TIME_STEP, obstacles=OBSTACLES)
        return float(np.sum(slope * rod.rollout(spec).positions))

    rod = Rod(PROPERTIES, node_count, tolerance=tolerance)
    gradient = rod.gradient(RolloutSpec(state, actions, TIME_STEP, obstacles=OBSTACLES), slope)
    exact = np.zeros_like(actions)
    for index in np.ndindex(*exact.shape):
        bump = np.zeros_like(exact)
        bump[index] = 1.0
        exact[index] = _slope(lambda h, bump=bump: cost(actions=actions + h * bump), 1e-4)
    parts = {}
    for part, h in STATE_PARTS.items():
        value = getattr(gradient.state, part)
        error = 0.0
        for _ in range(4):
            along = rng.normal(size=value.shape)
            truth = _slope(
                lambda h, part=part, along=along: cost(state=_displaced(state, part, h * along)), h
            )
            scale = np.linalg.norm(value) * np.linalg.norm(along)
            error = max(error, float(abs(np.sum(value * along) - truth) / scale))
        parts[part] = error
    truth = np.array(
        [
            _slope(
                lambda h, name=name: cost(rod=fine.with_properties(_changed(name, h))),
                1e-5 if name == "length" else 1e-3,
            )
            for name in PARAMETERS
        ]
    )
    ours = np.array([gradient.parameters[name] * _scale(name) for name in PARAMETERS])
    return {
        "nodes": node_count,
        "tolerance": tolerance,
        "actions": _relative(gradient.actions, exact),
        **parts,
        "parameters": _relative(ours, truth),
        # A parameter that is zero, and so its derivative by relative change, has no relative error.
        "worst_parameter": float(np.max(np.abs(ours[truth != 0.0] / truth[truth != 0.0] - 1.0))),
    }


def _changed(name: str, by: float) -> RodProperties:
    """Properties with one parameter changed, relative to its scale."""
    p = PROPERTIES
    if name == "bending_stiffness":
        return p.with_stiffness(p.bending_stiffness * (1.0 + by), p.twisting_stiffness)
    if name == "twisting_stiffness":
        return p.with_stiffness(p.bending_stiffness, p.twisting_stiffness * (1.0 + by))
    if name.startswith("rest"):
        rest = np.array(p.rest_curvature[0])
        rest[PARAMETERS.index(name) - PARAMETERS.index("rest_curvature_1")] += by
        return replace(p, rest_curvature=(tuple(rest),))
    return replace(p, **{name: getattr(p, name) * (1.0 + by)})


def _scale(name: str) -> float:
    return 1.0 if name.startswith("rest") else getattr(PROPERTIES, name)


def _displaced(state: RodState, part: str, by: Float64[np.ndarray, "m 3"]) -> RodState:
    if part == "rotations":
        turned = poses.multiply(poses.exponential(by), state.orientations)
        return replace(state, orientations=turned)
    return replace(state, **{part: getattr(state, part) + by})


def _slope(function: Callable[[float], float], h: float) -> float:
    near = function(h) - function(-h)
    return (8.0 * near - (function(2.0 * h) - function(-2.0 * h))) / (12.0 * h)


def _relative(computed: Float64[np.ndarray, "*a"], exact: Float64[np.ndarray, "*a"]) -> float:
    return float(np.linalg.norm(computed - exact) / np.linalg.norm(exact))
