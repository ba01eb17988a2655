"""The roll-out as a differentiable function of PyTorch."""

from __future__ import annotations

import numpy as np
import pytest

from lariat.rod import Rod, RodProperties, RolloutSpec

pytest.importorskip("torch")
import torch


def test_torch_gradients_match_finite_differences() -> None:
    from lariat.rod.torch import rollout

    p = RodProperties(0.45, 0.008, 0.044, 1e6)
    rod = Rod(p, 6, right="free", tolerance=1e-11)
    state = rod.straight([0.0, 0.0, 0.3], [1.0, 0.0, 0.3])
    rng = np.random.default_rng(0)
    start = [
        torch.tensor(value, requires_grad=True)
        for value in (
            0.3 * rng.normal(size=(2, 2, 6)),
            state.positions,
            0.1 * rng.normal(size=(6, 3)),
        )
    ]
    names = ("damping", "internal_damping")
    spec = RolloutSpec(state, np.zeros((2, 2, 6)), 0.01)

    def positions(
        actions: torch.Tensor, at: torch.Tensor, moving: torch.Tensor, values: torch.Tensor
    ) -> torch.Tensor:
        changed = RodProperties(
            p.length,
            p.diameter,
            p.linear_density,
            p.youngs_modulus,
            damping=float(values[0]),
            internal_damping=float(values[1]),
        )
        other = rod.with_properties(changed)
        return rollout(other, spec, actions, at, moving, values, names)

    values = torch.tensor([1.0, 0.01], dtype=torch.float64, requires_grad=True)
    assert torch.autograd.gradcheck(positions, (*start, values), eps=1e-6, atol=1e-6, rtol=1e-5)


def test_a_parameter_is_required_for_each_name() -> None:
    from lariat.rod.torch import rollout

    rod = Rod(RodProperties(0.45, 0.008, 0.044, 1e6), 6)
    state = rod.straight([0.0, 0.0, 0.3], [1.0, 0.0, 0.3])
    spec = RolloutSpec(state, np.zeros((1, 2, 6)), 0.01)
    at, none = torch.tensor(state.positions), torch.zeros(0)
    with pytest.raises(ValueError, match="names"):
        rollout(rod, spec, torch.zeros(1, 2, 6), at, 0 * at, none, names=("damping",))
