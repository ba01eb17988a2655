"""Roll-outs as differentiable functions of PyTorch."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lariat.geometry import Obstacle, pack
from lariat.rod import PARAMETERS, Rod, RodProperties, RolloutSpec
from lariat.rod.parameters import with_parameters

pytest.importorskip("torch")
import torch

from lariat.rod.torch import rollout

ROPE = RodProperties(0.45, 0.008, 0.044, 1e6, internal_damping=0.01, stiffness_profile=(1.0, 1.2))
BAR = Obstacle("capsule", (0.2, 0.0, 0.287), radius=0.01, height=0.02)
VALUES = {
    "bending_stiffness": ROPE.bending_stiffness,
    "twisting_stiffness": 1.3 * ROPE.twisting_stiffness,
    "stretch_stiffness": 1000.0,
    "damping": 1.0,
    "internal_damping": 0.01,
    "drag_coefficient": 5.0,
    "linear_density": 0.05,
    "length": 0.45,
    "rest_curvature_1": 0.5,
    "rest_curvature_2": -0.3,
    "rest_twist": 0.2,
    "yield_curvature": 1.0,
    "friction_factor": 1.5,
    "stiffness_profile[1]": 1.2,
}


def tensor(value: np.ndarray) -> torch.Tensor:
    return torch.tensor(value, dtype=torch.float64, requires_grad=True)


def test_gradients_of_a_batch_in_contact_match_finite_differences() -> None:
    rod = Rod(ROPE, 6, right="free", tolerance=1e-12)
    state = rod.straight([0.0, 0.0, 0.3], [1.0, 0.0, 0.3])
    rng = np.random.default_rng(0)
    spec = RolloutSpec([state] * 2, np.zeros((2, 2, 2, 6)), 0.01, obstacles=pack((BAR,)))
    actions = tensor(0.3 * rng.normal(size=(2, 2, 2, 6)))
    positions = tensor(np.stack([state.positions] * 2))
    velocities = tensor(0.1 * rng.normal(size=(2, 6, 3)))
    shared, own = tensor(np.array(1.0)), tensor(np.array([0.01, 0.02]))

    def moved(*inputs: torch.Tensor) -> torch.Tensor:
        a, x, v, damping, internal = inputs
        return rollout(rod, spec, a, x, v, {"damping": damping, "internal_damping": internal})

    inputs = (actions, positions, velocities, shared, own)
    assert torch.autograd.gradcheck(moved, inputs, eps=1e-6, atol=2e-5, rtol=1e-4)


def test_every_parameter_changes_the_rod_as_its_gradient_says() -> None:
    assert set(VALUES) >= set(PARAMETERS)
    rod = Rod(replace(ROPE, yield_curvature=2.0), 8, right="free", tolerance=1e-12)
    state = rod.straight([0.0, 0.0, 0.3], [1.0, 0.2, 0.3])
    actions = np.zeros((8, 2, 6))
    actions[:, 0] = [0.5, 0.2, 0.3, 1.0, 0.5, 2.0]
    spec = RolloutSpec(state, actions, 0.02)
    weights = torch.tensor(np.random.default_rng(1).normal(size=(8, 8, 3)))

    def cost(values: dict[str, torch.Tensor]) -> torch.Tensor:
        return (weights * rollout(rod, spec, parameters=values)).sum()

    values = {name: tensor(np.array(value)) for name, value in VALUES.items()}
    cost(values).backward()
    for name, value in values.items():
        h = 1e-6 * max(abs(VALUES[name]), 1e-3)
        costs = [
            float(cost({**values, name: (value + s * h).detach()}).detach()) for s in (1.0, -1.0)
        ]
        difference = (costs[0] - costs[1]) / (2.0 * h)
        assert value.grad is not None
        assert float(value.grad) == pytest.approx(difference, rel=1e-3, abs=1e-8), name


def test_one_rod_and_a_batch_of_one_move_alike() -> None:
    rod = Rod(ROPE, 10, right="free")
    state = rod.straight([0.0, 0.0, 0.3], [1.0, 0.0, 0.3])
    actions = np.full((5, 2, 6), 0.1)
    one = rollout(rod, RolloutSpec(state, actions, 0.02))
    batch = rollout(rod, RolloutSpec([state], actions[None], 0.02))
    assert torch.equal(batch[0], one)
    np.testing.assert_array_equal(one, rod.rollout(RolloutSpec(state, actions, 0.02)).positions)


def test_a_parameter_is_set_with_all_others_held_constant() -> None:
    changed = with_parameters(ROPE, {"bending_stiffness": 3e-4, "density_profile[0]": 1.1})
    assert changed.bending_stiffness == pytest.approx(3e-4)
    assert changed.twisting_stiffness == pytest.approx(ROPE.twisting_stiffness)
    assert changed.density_profile == (1.1,)
    assert with_parameters(ROPE, {}).youngs_modulus == pytest.approx(ROPE.youngs_modulus)


def test_tensors_that_do_not_fit_are_refused_by_name() -> None:
    rod = Rod(ROPE, 6)
    state = rod.straight([0.0, 0.0, 0.3], [1.0, 0.0, 0.3])
    spec = RolloutSpec([state] * 2, np.zeros((2, 1, 2, 6)), 0.01)
    with pytest.raises(ValueError, match=r"actions.*shape"):
        rollout(rod, spec, torch.zeros(1, 2, 6))
    with pytest.raises(ValueError, match="'damping'"):
        rollout(rod, spec, parameters={"damping": torch.ones(3)})
    with pytest.raises(ValueError, match="no parameter 'weight'"):
        rollout(rod, spec, parameters={"weight": torch.ones(2)})
