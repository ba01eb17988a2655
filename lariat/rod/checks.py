"""Checks of the arguments of a launch, before the kernel runs."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache

import numpy as np
from jaxtyping import Float64, Int64

from lariat.rod.rollout_spec import RolloutSpec
from lariat.rod.state import RodState

MAX_SPAN = 1.5
"""Distance between the ends of a state, relative to the rod's length, above which it is rejected
[-]. A smaller excess may be that of a rope under tension, or of an underestimated length."""
SQUARED_NORM_TOLERANCE = 0.002
"""Largest deviation of an orientation's squared norm from one [-]."""


def check_rollout(
    spec: RolloutSpec[RodState | Sequence[RodState]], actions: Float64[np.ndarray, "B K 2 6"]
) -> Int64[np.ndarray, "H"]:
    """Check a specification and return the block of every step.

    Args:
        spec: Specification of a roll-out.
        actions: Its `batched_actions`.

    Raises:
        ValueError: A field has the wrong shape or is out of its range.
    """
    count, steps = len(spec.states), spec.steps
    if actions.ndim != 4 or actions.shape[2:] != (2, 6) or len(actions) != count:
        raise ValueError(
            f"actions must be (blocks, 2 ends, 6), got shape {actions.shape[1:]} for {count} rod(s)"
        )
    if not isinstance(spec.dt, float) and np.ndim(spec.dt) != 0:
        raise ValueError(
            f"dt must be one duration for all steps, got {spec.dt} s; only Rod.settle takes a "
            "duration for each step"
        )
    if not (spec.dt > 0.0 and math.isfinite(spec.dt)):
        raise ValueError(f"dt must be positive, got {spec.dt} s; try 0.01")
    if spec.substeps < 1:
        raise ValueError(f"substeps must be at least 1, got {spec.substeps}")
    if not math.isfinite(np.vdot(actions, actions)):
        raise ValueError("actions must be finite; clip them first")
    blocks = actions.shape[1]
    block_of_step = spec.block_of_step
    if block_of_step is None:
        block_of_step = _blocks_in_turn(steps or blocks, blocks)
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
            f"block_of_step must increase from 0 to at most {blocks - 1}, got {block_of_step}"
        )
    return block_of_step


@lru_cache(maxsize=64)
def _blocks_in_turn(steps: int, blocks: int) -> Int64[np.ndarray, "H"]:
    block_of_step = np.minimum(np.arange(steps), blocks - 1)
    block_of_step.setflags(write=False)
    return block_of_step


def check_durations(durations: Float64[np.ndarray, "H"], blocks: int) -> None:
    """Check the durations of steps, one for each block of actions.

    Raises:
        ValueError: Their number is wrong, or one of them is not positive and finite.
    """
    if np.shape(durations) != (blocks,):
        raise ValueError(
            f"durations must be one for each of the {blocks} blocks of actions, got shape "
            f"{np.shape(durations)}"
        )
    if not (np.all(durations > 0.0) and np.all(np.isfinite(durations))):
        raise ValueError(f"durations must be positive and finite, got {durations} s")


def check_state(state: RodState, node_count: int, frame_count: int, layer_count: int = 0) -> None:
    """Check that a state fits a rod with numbers of nodes, of frames and of layers that yield.

    Raises:
        ValueError: A field has the wrong shape, is not finite, or is no unit quaternion.
    """
    x, v = np.asarray(state.positions), np.asarray(state.velocities)
    q, omega = np.asarray(state.orientations), np.asarray(state.angular_velocities)
    nodes, frames = (node_count, 3), (frame_count, 3)
    if state.plastic_curvature is not None:
        plastic, layers = np.asarray(state.plastic_curvature), (frame_count - 1, layer_count, 3)
        if plastic.shape != layers or not math.isfinite(np.vdot(plastic, plastic)):
            raise ValueError(
                f"state.plastic_curvature must be finite and {layers}, got shape {plastic.shape}; "
                f"this rod has {layer_count} layers that yield"
            )
    if x.shape == v.shape == nodes and omega.shape == frames and q.shape == (frame_count, 4):
        # Sums of products are finite if all factors are: a fourth of the time of a search.
        excess = np.vecdot(q, q) - 1.0
        off = np.vdot(excess, excess)
        if off <= SQUARED_NORM_TOLERANCE**2 and math.isfinite(
            np.vdot(x, v) + np.vdot(omega, omega)
        ):
            return
    for name, value, shape in (
        ("positions", x, nodes),
        ("orientations", q, (frame_count, 4)),
        ("velocities", v, nodes),
        ("angular_velocities", omega, frames),
    ):
        if value.shape != shape:
            raise ValueError(
                f"state.{name} must be {shape}, got {value.shape}; this rod has "
                f"{node_count} nodes and {frame_count} frames"
            )
        if not np.isfinite(value).all():
            raise ValueError(f"state.{name} must be finite")
    worst = np.abs(np.vecdot(q, q) - 1.0).max()
    if worst > SQUARED_NORM_TOLERANCE:
        raise ValueError(
            "state.orientations must be unit quaternions, got squared norms that are off by up "
            f"to {worst}; normalize them"
        )


def check_span(state: RodState, length: float) -> None:
    """Check that the ends of a state are not farther apart than a rod of a length [m] can reach.

    Raises:
        ValueError: The ends are too far apart.
    """
    distance = math.dist(state.positions[0], state.positions[-1])
    if distance > MAX_SPAN * length:
        raise ValueError(
            f"the ends of the state are {distance:.4f} m apart but the rod is {length} m long; "
            "bring them together"
        )
