"""Friction and yield of a rope are found while it is moved, where it touches and yields."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from lariat.control.estimation.adaptation import ParameterEstimate, apply_material
from lariat.control.estimation.material_filter import MaterialFilter
from lariat.control.estimation.rope_observation import RopeObservation
from lariat.control.estimation.state_estimator import StateEstimator
from lariat.geometry import Obstacle, pack, poses
from lariat.geometry.poses import Pose
from lariat.rod import Rod, RodProperties, RolloutSpec
from lariat.trajectory import MotionState

COUNT = 40
ROPE = RodProperties(0.45, 0.008, 0.044, 1e6)
CABLE = replace(ROPE, yield_curvature=6.0)
PERIOD = 0.04
NOISE = 1e-3


def estimated(
    name: str,
    given: RodProperties,
    true: RodProperties,
    height: float,
    velocity: Callable[[float], np.ndarray],
    seconds: float,
) -> ParameterEstimate:
    """Return an estimate after a rope has been moved above, or along, a table of friction 0.15."""
    model, plant = Rod(given, COUNT), Rod(true, COUNT)
    along = poses.rotation_between(np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0]))
    table = pack([Obstacle("half_space", (0.0, 0.0, 0.0), friction=0.15, support=True)])
    places = np.array([[-0.2, 0.0, height], [0.2, 0.0, height]])

    def motion() -> MotionState:
        return MotionState.at_rest(*(Pose(place, along) for place in places))

    state = plant.rest(*motion().grips, obstacles=table).state
    now = 1_000_000_000
    estimator, adaptation = StateEstimator(model, motion(), now), MaterialFilter(given)
    estimator.supports = table
    estimator.restart(motion(), now)
    random = np.random.default_rng(0)
    for k in range(round(seconds / PERIOD)):
        actions = np.zeros((1, 2, 6))
        actions[0, :, :3] = velocity(PERIOD * k)
        spec = RolloutSpec(state, actions, PERIOD / 4, steps=4, obstacles=table)
        state = plant.rollout(spec).final
        places = places + PERIOD * actions[0, :, :3]
        now += round(1e9 * PERIOD)
        estimator.advance(motion(), now)
        seen = state.positions + NOISE * random.normal(size=(COUNT, 3))
        rope = RopeObservation(now, seen, np.full(COUNT, NOISE), np.ones(COUNT, dtype=bool))
        estimator.observe(rope)
        change = adaptation.update(estimator, rope)
        if change is not None:
            apply_material(estimator, adaptation, change, moving=True)
    return adaptation.scalars[name]


def aside(t: float) -> np.ndarray:
    return np.tile([0.0, 0.15 * math.sin(2.0 * t), 0.0], (2, 1))


def together(t: float) -> np.ndarray:
    return 0.12 * math.sin(1.5 * t) * np.array([[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]])


@pytest.mark.parametrize(("height", "known"), [(0.03, True), (0.4, False)])
def test_friction_is_found_where_the_rope_touches(height: float, known: bool) -> None:
    rough = replace(ROPE, friction_factor=2.0)
    found = estimated("friction_factor", ROPE, rough, height, aside, 2.5)
    assert found.known == known
    deviation = found.standard_deviation
    assert abs(found.value - 2.0) < 3.0 * deviation < 1.5 if known else deviation > 0.6


def test_yield_curvature_is_found_where_the_cable_yields() -> None:
    harder = replace(CABLE, yield_curvature=9.0)
    found = estimated("yield_curvature", CABLE, harder, 0.4, together, 5.5)
    assert found.known
    assert abs(found.value - 9.0) < 3.0 * found.standard_deviation < 3.0


def test_yield_curvature_is_unknown_where_nothing_yields() -> None:
    held = estimated("yield_curvature", CABLE, CABLE, 0.4, lambda t: np.zeros((2, 3)), 1.0)
    assert not held.known
    assert "yield_curvature" not in MaterialFilter(ROPE).scalars
