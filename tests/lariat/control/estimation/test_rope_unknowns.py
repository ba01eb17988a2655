"""Derivatives of the rest shape in the material and in how the grips hold the rope."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lariat.control.estimation.rope_unknowns import RopeUnknowns
from lariat.control.estimation.state_estimator import StateEstimator
from lariat.geometry import poses
from lariat.geometry.poses import Pose
from lariat.rod import Rod, RodProperties
from lariat.trajectory import MotionState

PROPERTIES = RodProperties(0.45, 0.008, 0.044, 1e6)
COUNT = 20


def estimator() -> StateEstimator:
    """Rope at rest between two grips of different orientations."""
    level = np.array([0.5, 0.5, 0.5, 0.5])
    turned = poses.multiply(poses.exponential(np.array([0.2, -0.3, 0.4])), level)
    grips = Pose(np.array([-0.14, 0.0, 0.3]), level), Pose(np.array([0.13, 0.06, 0.33]), turned)
    return StateEstimator(Rod(PROPERTIES, COUNT, tolerance=1e-10), MotionState.at_rest(*grips), 0)


@pytest.mark.parametrize(
    ("group", "step"),
    [
        ("bending_stiffness", 1e-3),
        ("length", 1e-4),
        ("grip_offset", 1e-5),
        ("grip_rotation", 1e-3),
    ],
)
def test_jacobian_is_the_change_of_the_rest_shape(group: str, step: float) -> None:
    unknowns, model = RopeUnknowns.of(PROPERTIES), estimator()
    jacobian = unknowns.shape_jacobian(
        model, np.zeros(unknowns.count), np.ones(unknowns.count, dtype=bool)
    )
    for k in range(unknowns.count)[unknowns.groups[group]]:
        shapes = []
        for sign in (-1.0, 1.0):
            x = np.zeros(unknowns.count)
            x[k] = sign * step
            held = unknowns.grip_errors(x).held(model.motion)
            rod = model.rod.with_properties(  # pyright: ignore[reportAttributeAccessIssue]
                replace(unknowns.properties(x), stretch_stiffness=PROPERTIES.stretch_stiffness)
            )
            shapes.append(rod.rest(*held.grips, guess=model.state).state.positions)
        expected = (shapes[1] - shapes[0]) / (2.0 * step)
        size = np.abs(expected).max()
        # A few steps of the dynamics stand for the equilibrium.
        assert np.abs(jacobian[..., k] - expected).max() < 0.05 * size


def test_zero_is_the_given_rope_in_exact_grips() -> None:
    unknowns = RopeUnknowns.of(PROPERTIES)
    x = np.zeros(unknowns.count)
    assert unknowns.properties(x).bending_stiffness == pytest.approx(PROPERTIES.bending_stiffness)
    assert not unknowns.grip_errors(x).offsets.any()
    assert not unknowns.grip_errors(x).rotations.any()
