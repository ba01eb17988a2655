"""Roll-outs as differentiable functions of PyTorch; the only module of the rod that imports it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import torch
from jaxtyping import Float, Float64

from lariat.rod.parameters import with_parameters
from lariat.rod.rod import Rod
from lariat.rod.rollout_spec import RolloutSpec
from lariat.rod.state import RodState


def rollout(
    rod: Rod,
    spec: RolloutSpec[RodState] | RolloutSpec[Sequence[RodState]],
    actions: Float[torch.Tensor, "*B K 2 6"] | None = None,
    positions: Float[torch.Tensor, "*B n 3"] | None = None,
    velocities: Float[torch.Tensor, "*B n 3"] | None = None,
    parameters: Mapping[str, Float[torch.Tensor, "*B"]] | None = None,
) -> Float[torch.Tensor, "*B H n 3"]:
    """Return the node positions after every step [m], differentiable once.

    Forward and backward are one launch each for all rods of one material. Contact with the
    obstacles of the specification is part of the derivatives.

    Args:
        rod: Rod to simulate.
        spec: Roll-out of one rod or of a batch of B rods.
        actions: Grip velocities [m/s, rad/s]; by default those of the specification.
        positions: Initial node positions [m]; by default those of the specification.
        velocities: Initial node velocities [m/s]; by default those of the specification.
        parameters: Values that replace those of the rod, by a name of `lariat.rod.PARAMETERS`:
            one for all rods, or one for each rod of a batch.

    Raises:
        ValueError: A tensor does not fit the specification, or a parameter is unknown.
    """
    states = spec.states
    leaves = {
        "actions": (actions, np.asarray(spec.actions, float)),
        "positions": (positions, _like(spec, [s.positions for s in states])),
        "velocities": (velocities, _like(spec, [s.velocities for s in states])),
    }
    tensors = []
    for name, (tensor, default) in leaves.items():
        if tensor is not None and tuple(tensor.shape) != default.shape:
            raise ValueError(
                f"{name} must have shape {default.shape}, got {tuple(tensor.shape)}; the "
                "specification gives the shape"
            )
        tensors.append(torch.as_tensor(default) if tensor is None else tensor)
    batch = (len(states),) if spec.is_batch else ()
    for name, value in (parameters or {}).items():
        if tuple(value.shape) not in ((), batch):
            raise ValueError(
                f"parameter {name!r} must be one number, or one for each of the {len(states)} "
                f"rods, got shape {tuple(value.shape)}"
            )
    names = tuple(parameters or {})
    values = [v.expand(len(states)) for v in (parameters or {}).values()]
    table = torch.stack(values, 1) if values else torch.zeros(len(states), 0)
    return _Rollout.apply(*tensors, table, rod, spec, names)  # type: ignore[return-value]


class _Rollout(torch.autograd.Function):
    """Roll-outs and their adjoint, in the form that autograd requires."""

    @staticmethod
    def forward(
        ctx: Any,
        actions: torch.Tensor,
        positions: torch.Tensor,
        velocities: torch.Tensor,
        parameters: torch.Tensor,
        rod: Rod,
        spec: RolloutSpec[Any],
        names: tuple[str, ...],
    ) -> torch.Tensor:
        batch = (
            _batched(spec, actions),
            _batched(spec, positions),
            _batched(spec, velocities),
            _array(parameters),
        )
        ctx.groups = _groups(rod, spec, names, *batch)
        ctx.names, ctx.is_batch = names, spec.is_batch
        ctx.save_for_backward(actions, positions, velocities, parameters)
        motions: dict[int, np.ndarray] = {}
        for members, one_rod, part in ctx.groups:
            for b, motion in zip(members, one_rod.rollout(part), strict=True):
                motions[b] = motion.positions
        result = np.stack([motions[b] for b in range(len(motions))])
        return torch.as_tensor(result if spec.is_batch else result[0]).to(actions)

    @staticmethod
    @torch.autograd.function.once_differentiable
    def backward(ctx: Any, *output_gradients: torch.Tensor) -> tuple:  # pyright: ignore
        seed = _array(output_gradients[0])
        seed = seed if ctx.is_batch else seed[None]
        gradients = [np.zeros(t.shape) for t in ctx.saved_tensors]
        for members, one_rod, part in ctx.groups:
            # Roll-out and adjoint are one launch, which saves storing every step's factors.
            for b, gradient in zip(
                members, one_rod.gradient(part, seed[members], ctx.names), strict=True
            ):
                at = b if ctx.is_batch else ...
                gradients[0][at] = gradient.actions
                gradients[1][at] = gradient.state.positions
                gradients[2][at] = gradient.state.velocities
                gradients[3][b] = [gradient.parameters[name] for name in ctx.names]
        likes = zip(gradients, ctx.saved_tensors, strict=True)
        return (*(torch.as_tensor(g).to(t) for g, t in likes), None, None, None)


def _groups(
    rod: Rod,
    spec: RolloutSpec[Any],
    names: tuple[str, ...],
    actions: Float64[np.ndarray, "B K 2 6"],
    positions: Float64[np.ndarray, "B n 3"],
    velocities: Float64[np.ndarray, "B n 3"],
    values: Float64[np.ndarray, "B P"],
) -> list[tuple[list[int], Rod, RolloutSpec[list[RodState]]]]:
    """Members of the batch, rod and roll-out of each group of rods of one material."""
    states = [
        replace(state, positions=x, velocities=v)
        for state, x, v in zip(spec.states, positions, velocities, strict=True)
    ]
    members: dict[tuple[float, ...], list[int]] = {}
    for b, row in enumerate(values.tolist()):
        members.setdefault(tuple(row), []).append(b)
    groups = []
    for row, group in members.items():
        changed = with_parameters(rod.properties, dict(zip(names, row, strict=True)))
        part = replace(spec, state=[states[b] for b in group], actions=actions[group])
        groups.append((group, rod.with_properties(changed) if names else rod, part))
    return groups


def _like(spec: RolloutSpec[Any], rows: list[np.ndarray]) -> Float64[np.ndarray, "*B n 3"]:
    return np.stack(rows) if spec.is_batch else rows[0]


def _batched(spec: RolloutSpec[Any], tensor: torch.Tensor) -> Float64[np.ndarray, "B *a"]:
    array = _array(tensor)
    return array if spec.is_batch else array[None]


def _array(tensor: torch.Tensor) -> Float64[np.ndarray, "*a"]:
    return tensor.detach().to(torch.float64).cpu().numpy()
