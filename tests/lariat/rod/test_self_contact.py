"""Contact of a rope with itself, in a knot whose strands must not pass through each other."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from jaxtyping import Float64

from lariat.geometry import Obstacle, pack, polylines, poses
from lariat.geometry.obstacles import FRICTION_COLUMN
from lariat.rod import End, Rod, RodProperties, RodState, RolloutSpec
from lariat.rod.initial_shapes import state_along
from lariat.rod.strains import curvatures, moments

PROPERTIES = RodProperties(0.8, 0.008, 0.044, 1e6, damping=2.0)
N, DT = 40, 0.005
Z = np.array([0.0, 0.0, 1.0])


def overhand() -> RodState:
    """Return a loose overhand knot, without clamps."""
    t = np.linspace(-2.15, 2.15, 4000)
    curve = np.stack([t**3 - 3.0 * t, t**4 - 4.0 * t**2, 1.2 * (t**5 / 5.0 - 2.0 * t)], axis=1)
    curve *= PROPERTIES.length / polylines.length(curve)
    nodes = polylines.resample(curve, N)
    tangents = poses.normalized(np.diff(nodes, axis=0))
    first, last = poses.rotation_between(Z, tangents[[0, -1]])
    return state_along(nodes, first, last, (0, 0))


def knotted(self_contact: bool) -> Rod:
    return Rod(
        PROPERTIES, N, "pinned", "pinned", gravity=(0.0, 0.0, 0.0), self_contact=self_contact
    )


def nearest_strands(nodes: Float64[np.ndarray, "n 3"]) -> float:
    """Return the least distance of points four diameters apart along the rope, in diameters."""
    s = np.linspace(0.0, len(nodes) - 1.0, 6 * len(nodes))
    points = np.stack([np.interp(s, np.arange(len(nodes)), column) for column in nodes.T], axis=1)
    distances = np.linalg.norm(points[:, None] - points[None], axis=2)
    arc = np.abs(s[:, None] - s[None]) * PROPERTIES.length / (N - 1)
    return float(np.min(distances[arc > 4.0 * PROPERTIES.diameter])) / PROPERTIES.diameter


@cache
def pulled(self_contact: bool) -> tuple[RodState, float]:
    """Return the knot with its ends 0.8 lengths apart, and the least distance of strands so far."""
    rod, state, closest = knotted(self_contact), overhand(), np.inf
    span = state.positions[-1] - state.positions[0]
    further = 0.8 * PROPERTIES.length / np.linalg.norm(span) - 1.0
    actions = np.zeros((1, 2, 6))
    actions[0, :, :3] = np.outer([-0.5, 0.5], span) * further / 1.5
    for _ in range(30):
        rolled = rod.rollout(RolloutSpec(state, actions, DT, steps=10))
        assert rolled.failure is None
        state = rolled.final
        closest = min(closest, *map(nearest_strands, rolled.positions[::5]))
    return state, closest


def test_strands_of_a_knot_that_is_pulled_tight_keep_their_distance() -> None:
    _, closest = pulled(True)
    assert closest > 0.95


def test_without_self_contact_the_same_pull_moves_strands_through_each_other() -> None:
    _, closest = pulled(False)
    assert closest < 0.5


def test_a_tight_knot_gains_no_energy() -> None:
    rod = knotted(True)
    state, _ = pulled(True)
    mass = PROPERTIES.linear_density * rod.edge_length
    energies = []
    for _ in range(40):
        bending = np.sum(moments(rod, state) * curvatures(rod, state)) * rod.edge_length / 2.0
        energies.append(bending + 0.5 * mass * np.sum(state.velocities[1:-1] ** 2))
        state = rod.rollout(RolloutSpec(state, np.zeros((1, 2, 6)), DT)).final
    # The first sample still holds the velocity of the ends; pushed strands give a little back.
    assert max(energies[1:]) < 1.01 * energies[0]


@pytest.mark.parametrize(
    ("held", "friction"), [("pinned", None), ("clamped", None), ("pinned", 0.3)]
)
def test_derivatives_of_a_tight_knot_match_differences(held: End, friction: float | None) -> None:
    rod = Rod(PROPERTIES, N, held, held, tolerance=1e-10, self_contact=True)
    state, _ = pulled(True)
    table = None
    if friction is not None:
        # The wall touches the knot beside its long ends.
        state, under = state.at_rest(), state.positions[:, 1].min() - 0.5 * PROPERTIES.diameter
        wall = Obstacle("half_space", (0.0, under, 0.0), normal=(0.0, 1.0, 0.0), friction=friction)
        table = pack([wall])
    if held == "clamped":
        q = state.orientations
        frames = np.vstack([q[:1], q, q[-1:]])
        state = RodState(state.positions, frames, state.velocities, np.zeros((N + 1, 3)))
    rng = np.random.default_rng(1)
    actions = 0.05 * rng.normal(size=(4, 2, 6))
    cost_gradient = rng.normal(size=(4, N, 3))
    names = ("bending_stiffness", "length", *([] if table is None else ["friction[0]"]))
    spec = RolloutSpec(state, actions, DT, obstacles=table)
    found = rod.gradient(spec, cost_gradient, names)
    forward = rod.linearize(spec, names)
    assert found.rollout.converged.all()
    assert forward.rollout.converged.all()
    swept = np.einsum("hni,hnikea->kea", cost_gradient, forward.d_positions_d_actions)
    np.testing.assert_allclose(swept, found.actions, atol=1e-9 * np.abs(swept).max())

    def cost(rod: Rod, state: RodState, actions: Float64[np.ndarray, "K 2 6"]) -> float:
        spec = RolloutSpec(state, actions, DT, obstacles=table)
        return float(np.sum(cost_gradient * rod.rollout(spec).positions))

    def stiffer(h: float) -> float:
        bending, twisting = PROPERTIES.bending_stiffness, PROPERTIES.twisting_stiffness
        changed = PROPERTIES.with_stiffness(bending + h, twisting)
        return cost(rod.with_properties(changed), state, actions)

    def longer(h: float) -> float:
        changed = replace(PROPERTIES, length=PROPERTIES.length + h)
        return cost(rod.with_properties(changed), state, actions)

    direction = rng.normal(size=actions.shape)
    push = rng.normal(size=state.positions.shape)

    def driven(h: float) -> float:
        return cost(rod, state, actions + h * direction)

    def pushed(h: float) -> float:
        moved = replace(state, positions=state.positions + h * push)
        return cost(rod, moved, actions)

    def rougher(h: float) -> float:
        assert table is not None
        bodies = table.copy()
        bodies[0, FRICTION_COLUMN] += h
        motion = rod.rollout(RolloutSpec(state, actions, DT, obstacles=bodies))
        return float(np.sum(cost_gradient * motion.positions))

    rough = ((rougher, 3e-4, found.parameters.get("friction[0]", 0.0), 0.0),)
    # Slips are as small as the rounding of their differences.
    limit = 1e-6 if table is None else 5e-6
    # Small steps: where a strand's nearest point goes round a node there is a kink.
    for function, h, exact, scale in (
        (driven, 1e-5, np.sum(direction * found.actions), np.linalg.norm(found.actions)),
        (pushed, 1e-8, np.sum(push * found.state.positions), 0.0),
        (longer, 1e-6, found.parameters["length"], 0.0),
        (stiffer, 3e-8, found.parameters["bending_stiffness"], 0.0),
        *(rough if table is not None else ()),
    ):
        near = function(h) - function(-h)
        measured = (8.0 * near - (function(2.0 * h) - function(-2.0 * h))) / (12.0 * h)
        assert abs(exact - measured) < limit * max(abs(measured), scale), function.__name__
