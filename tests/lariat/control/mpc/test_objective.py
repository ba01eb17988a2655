"""Gradient of the objective."""

from __future__ import annotations

import numpy as np
import pytest

from lariat.control.mpc.collision_avoidance import (
    AvoidanceSpecification,
    GripPrediction,
    rope_clearance_residuals,
)
from lariat.control.mpc.objective import (
    NormalEquations,
    ObjectiveWeights,
    effort_terms,
    orientation_terms,
    rope_terms,
)
from lariat.geometry import poses
from lariat.geometry.obstacles import Obstacle

HORIZON, COUNT, VARIABLES = 3, 9, 4
POST = Obstacle("sphere", (0.02, 0.03, 0.0), radius=0.02, name="post")
CRATE = Obstacle("sphere", (-0.25, 0.02, 0.01), radius=0.015, name="crate")
AROUND = AvoidanceSpecification((POST,), 0.012, 0.004, 0.44, 0.002, (POST, CRATE), 0.05, 0.05)


@pytest.mark.parametrize("along", [1.0, 0.3])
def test_gradient_equals_finite_differences_of_the_cost(along: float) -> None:
    random = np.random.default_rng(0)
    line = np.stack([np.linspace(-0.2, 0.2, COUNT), *np.zeros((2, COUNT))], axis=1)
    nodes = line + 0.005 * random.normal(size=(HORIZON, 1, 3))
    jacobian = random.normal(size=(HORIZON, COUNT, 3, VARIABLES))
    turns = random.normal(size=(HORIZON, 2, 3, VARIABLES))
    along_x = np.tile([0.70710678, 0.0, 0.70710678, 0.0], (HORIZON, 2, 1))
    goal = nodes + 0.01 * random.normal(size=nodes.shape)

    def at(change: np.ndarray) -> NormalEquations:
        moved = nodes + jacobian @ change
        ends = [0, -1]
        orientations = poses.multiply(poses.exponential(turns @ change), along_x)
        grips = GripPrediction(moved[:, ends], orientations, jacobian[:, ends], turns)
        return rope_terms(moved, grips, jacobian, goal, AROUND, 0.05, along)

    here = at(np.zeros(VARIABLES))
    assert set(here.cost) == {"tracking", "calm", "obstacles", "grippers"}
    assert min(here.cost.values()) > 0.0
    measured = [(at(d).total - at(-d).total) / 2e-7 for d in 1e-7 * np.eye(VARIABLES)]
    assert np.allclose(2.0 * here.gradient, measured, rtol=1e-4)


def test_gradients_of_effort_and_orientation_equal_finite_differences() -> None:
    random = np.random.default_rng(0)
    velocities, initial = random.normal(size=(HORIZON, 2)), random.normal(size=2)
    unit, rotation = np.array([1.0, 0.3]), random.normal(size=2)
    means, oriented = np.tril(random.uniform(size=(HORIZON, HORIZON))), np.array([False, True])

    def effort(v: np.ndarray) -> NormalEquations:
        return effort_terms(v, initial, unit, ObjectiveWeights(), 0.05)

    def orientation(v: np.ndarray) -> NormalEquations:
        return orientation_terms(v, means, rotation, oriented, unit, 0.05)

    for terms in (effort, orientation):
        here, steps = terms(velocities), 1e-4 * np.eye(velocities.size)
        changes = [step.reshape(velocities.shape) for step in steps]
        around = [(terms(velocities + d).total, terms(velocities - d).total) for d in changes]
        measured = [(above - below) / 2e-4 for above, below in around]
        np.testing.assert_allclose(2.0 * here.gradient, measured, rtol=1e-5, atol=1e-6)


def test_going_on_at_the_present_velocity_takes_no_acceleration() -> None:
    initial = np.array([0.1, -0.2])
    even = effort_terms(
        np.tile(initial, (HORIZON, 1)), initial, np.ones(2), ObjectiveWeights(), 0.05
    )
    assert even.cost["acceleration"] == pytest.approx(0.0, abs=1e-12)
    assert even.cost["speed"] > 0.0


def test_place_along_the_rope_counts_by_its_weight() -> None:
    goal = np.stack([np.linspace(-0.2, 0.2, COUNT), *np.zeros((2, COUNT))], axis=1)[None]
    jacobian, free = np.zeros((1, COUNT, 3, 1)), AvoidanceSpecification((), 0.0, 0.0, 0.44)
    ends = GripPrediction(
        goal[:, [0, -1]], np.zeros((1, 2, 4)), np.zeros((1, 2, 3, 1)), np.zeros((1, 2, 3, 1))
    )
    costs = []
    for shift in ((0.001, 0.0, 0.0), (0.0, 0.001, 0.0)):
        terms = rope_terms(goal + shift, ends, jacobian, goal, free, 0.05, along=0.3)
        costs.append(terms.cost["tracking"])
    np.testing.assert_allclose(costs, [0.09, 1.0])


def test_clearance_is_also_kept_between_nodes() -> None:
    nodes = np.stack([np.linspace(-0.2, 0.2, COUNT), *np.zeros((2, COUNT))], axis=1)[None]
    jacobian = np.zeros((1, COUNT, 3, 1))
    jacobian[:, :, 1] = 1.0
    # 25 mm from the nodes of an edge along the rope, 5.5 mm from its middle.
    pin = Obstacle("sphere", (0.025, 0.0065, 0.0), radius=0.001, name="pin")
    avoidance = AvoidanceSpecification((pin,), 0.004, 0.004, 0.44)
    residuals, rows = rope_clearance_residuals(nodes, jacobian, avoidance)
    np.testing.assert_allclose(residuals, [2.0 * (8.0 - 5.5)])
    # The residual falls while the rope moves away, towards negative y.
    np.testing.assert_allclose(rows, [[2000.0]])
