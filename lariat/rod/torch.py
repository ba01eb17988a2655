"""The roll-out as one function of torch; the only file of the rod that imports it."""

from __future__ import annotations

from typing import Any

import numpy as np
import torch
from jaxtyping import Float64

from lariat.rod.rod import Rod
from lariat.rod.state import RodState


def rollout(
    rod: Rod,
    actions: torch.Tensor,
    positions: torch.Tensor,
    velocities: torch.Tensor,
    parameters: torch.Tensor,
    state: RodState,
    dt: float,
    substeps: int = 1,
    obstacles: Float64[np.ndarray, "m 12"] | None = None,
    names: tuple[str, ...] = (),
) -> torch.Tensor:
    """Positions after every step (H n 3) [m], differentiable once; one launch each way.

    Args:
        rod: Whose roll-out; `parameters` tell autograd what of it may change, and do not set it.
        actions: (K 2 6), constant over a step each.
        positions: Of the start (n 3) [m].
        velocities: Of the start (n 3) [m/s].
        parameters: Values of `names`, as `rod` has them; empty where none is asked for.
        state: The start's orientations and angular velocities; its other fields are not read.
        dt: Duration of a step [s].
        substeps: Implicit steps per step.
        obstacles: From `lariat.geometry.obstacles.pack`.
        names: Of the parameters, as in `lariat.rod.PARAMETERS`.

    Raises:
        ValueError: There are not as many parameters as names, or the rod refuses its input.
    """
    if parameters.numel() != len(names):
        raise ValueError(f"{len(names)} names need as many parameters, got {parameters.numel()}")
    options = (rod, state, dt, substeps, obstacles, names)
    return _Rollout.apply(actions, positions, velocities, parameters, options)  # type: ignore[return-value]


class _Rollout(torch.autograd.Function):
    @staticmethod
    def forward(
        ctx: Any,
        actions: torch.Tensor,
        positions: torch.Tensor,
        velocities: torch.Tensor,
        parameters: torch.Tensor,
        options: tuple,
    ) -> torch.Tensor:
        rod, state, dt, substeps, obstacles, _names = options
        start = RodState(
            _array(positions), state.orientations, _array(velocities), state.angular_velocities
        )
        ctx.options = (start, *options)
        ctx.save_for_backward(actions)
        rolled = rod.rollout(start, _array(actions), dt, substeps=substeps, obstacles=obstacles)
        return torch.as_tensor(rolled.positions).to(actions)

    @staticmethod
    @torch.autograd.function.once_differentiable
    def backward(ctx: Any, *slopes: torch.Tensor) -> tuple:  # pyright: ignore
        (actions,) = ctx.saved_tensors
        start, rod, _state, dt, substeps, obstacles, names = ctx.options
        # Roll-out and adjoint are one launch, which saves keeping every step's factors between.
        found = rod.gradient(
            start,
            _array(actions),
            dt,
            substeps=substeps,
            obstacles=obstacles,
            parameters=names,
            d_cost_d_positions=_array(slopes[0]),
        )
        values = [found.parameters[name] for name in names]
        return (
            torch.as_tensor(found.actions).to(actions),
            torch.as_tensor(found.state.positions).to(actions),
            torch.as_tensor(found.state.velocities).to(actions),
            torch.tensor(values, dtype=actions.dtype),
            None,
        )


def _array(tensor: torch.Tensor) -> Float64[np.ndarray, "*a"]:
    return tensor.detach().to(torch.float64).cpu().numpy()
