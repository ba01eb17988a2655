"""Refuses what no kernel should see, by name."""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Float64, Int64

from lariat.rod.state import RodState


def check_launch(
    count: int,
    actions: Float64[np.ndarray, "B K 2 6"],
    dt: float | Float64[np.ndarray, "H"],
    steps: int | None,
    block_of_step: Int64[np.ndarray, "H"] | None,
    substeps: int,
) -> Int64[np.ndarray, "H"]:
    """The block of every step.

    Args:
        count: Rods.
        dt: Of a step, or of each [s].
        steps: Steps that were asked for, if any were.
    """
    if actions.ndim != 4 or actions.shape[2:] != (2, 6) or len(actions) != count:
        raise ValueError(
            f"actions must be (blocks, 2 ends, 6), got shape {actions.shape[1:]} for {count} rod(s)"
        )
    durations = np.atleast_1d(np.asarray(dt, float))
    if not (durations.min() > 0.0 and math.isfinite(durations.max())):
        raise ValueError(f"dt must be positive, got {dt} s; try 0.01")
    if substeps < 1:
        raise ValueError(f"substeps must be at least 1, got {substeps}")
    if not np.isfinite(actions).all():
        raise ValueError("actions hold a number that is not finite; were they clipped?")
    blocks = actions.shape[1]
    if block_of_step is None:
        block_of_step = np.minimum(np.arange(steps or blocks), blocks - 1)
        if len(block_of_step) and blocks:
            return block_of_step
    block_of_step = np.asarray(block_of_step, dtype=np.int64)
    if len(block_of_step) < 1 or (steps is not None and steps != len(block_of_step)):
        raise ValueError(
            f"block_of_step must name a block for each of the {steps} steps, got "
            f"{len(block_of_step)}"
        )
    if block_of_step[0] < 0 or block_of_step[-1] >= blocks or np.any(np.diff(block_of_step) < 0):
        raise ValueError(
            f"block_of_step must rise from 0 to at most {blocks - 1}, got {block_of_step}"
        )
    return block_of_step


def check_state(state: RodState, n: int) -> None:
    """Shapes, finite numbers and unit quaternions."""
    for name, rows, width in (
        ("positions", n, 3),
        ("orientations", n - 1, 4),
        ("velocities", n, 3),
        ("angular_velocities", n - 1, 3),
    ):
        value = getattr(state, name)
        if np.shape(value) != (rows, width):
            raise ValueError(
                f"state.{name} must be ({rows}, {width}), got {np.shape(value)}; this rod has {n} "
                "nodes"
            )
        if not np.isfinite(value).all():
            raise ValueError(f"state.{name} holds a number that is not finite")
    lengths = np.einsum("ij,ij->i", state.orientations, state.orientations)
    if lengths.min() < 0.998 or lengths.max() > 1.002:
        raise ValueError("state.orientations must be unit quaternions; normalise them")
