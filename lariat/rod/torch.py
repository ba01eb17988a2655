"""Roll-out as a differentiable function of PyTorch; the only module of the rod that imports it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import torch
from jaxtyping import Float64

from lariat.rod.rod import Rod
from lariat.rod.rollout_spec import RolloutSpec
from lariat.rod.state import RodState


def rollout(
    rod: Rod,
    spec: RolloutSpec[RodState],
    actions: torch.Tensor,
    positions: torch.Tensor,
    velocities: torch.Tensor,
    parameters: torch.Tensor,
    names: tuple[str, ...] = (),
) -> torch.Tensor:
    """Return the positions after every step (H n 3) [m], differentiable once.

    Forward and backward are one launch each. Tensors replace the fields of the specification that
    have their names.

    Args:
        rod: Rod to simulate.
        spec: Roll-out of one rod; its actions, positions and velocities are not read.
        actions: Grip velocities (K 2 6), as `RolloutSpec.actions`.
        positions: Initial node positions (n 3) [m].
        velocities: Initial node velocities (n 3) [m/s].
        parameters: Values of `names`, which must be those of `rod`: derivatives are taken with
            respect to them, but they do not change the rod. Empty if `names` is.
        names: Parameters to differentiate in, as in `lariat.rod.PARAMETERS`.

    Raises:
        ValueError: The number of parameters differs from that of names, or the specification does
            not fit the rod.
    """
    if parameters.numel() != len(names):
        raise ValueError(f"{len(names)} names need as many parameters, got {parameters.numel()}")
    return _Rollout.apply(actions, positions, velocities, parameters, rod, spec, names)  # type: ignore[return-value]


class _Rollout(torch.autograd.Function):
    """Roll-out and its adjoint, in the form that autograd requires."""

    @staticmethod
    def forward(
        ctx: Any,
        actions: torch.Tensor,
        positions: torch.Tensor,
        velocities: torch.Tensor,
        parameters: torch.Tensor,
        rod: Rod,
        spec: RolloutSpec[RodState],
        names: tuple[str, ...],
    ) -> torch.Tensor:
        state = replace(spec.state, positions=_array(positions), velocities=_array(velocities))
        ctx.spec = replace(spec, state=state, actions=_array(actions))
        ctx.rod, ctx.names = rod, names
        ctx.save_for_backward(actions)
        return torch.as_tensor(rod.rollout(ctx.spec).positions).to(actions)

    @staticmethod
    @torch.autograd.function.once_differentiable
    def backward(ctx: Any, *output_gradients: torch.Tensor) -> tuple:  # pyright: ignore
        (actions,) = ctx.saved_tensors
        # Roll-out and adjoint are one launch, which saves storing every step's factors in between.
        found = ctx.rod.gradient(ctx.spec, _array(output_gradients[0]), ctx.names)
        values = [found.parameters[name] for name in ctx.names]
        return (
            torch.as_tensor(found.actions).to(actions),
            torch.as_tensor(found.state.positions).to(actions),
            torch.as_tensor(found.state.velocities).to(actions),
            torch.tensor(values, dtype=actions.dtype),
            None,
            None,
            None,
        )


def _array(tensor: torch.Tensor) -> Float64[np.ndarray, "*a"]:
    return tensor.detach().to(torch.float64).cpu().numpy()
