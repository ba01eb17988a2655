"""Motion that every solver computes, and the interface of a solver."""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from jaxtyping import Float64

from lariat.geometry import poses
from lariat.geometry.poses import Pose
from lariat.rod import Rod, RodProperties, RodState

ACTION_DURATION, ACTION_COUNT = 0.01, 100
"""Duration of an action [s], number of actions."""
SETTLING_COUNT, SETTLING_DAMPING = 100, 12.0
"""Number of actions for which the grips stand still before a rope counts as at rest, and damping
force per velocity and mass meanwhile [1/s], for solvers without a search for equilibria."""
PROPERTIES = RodProperties(0.45, 0.008, 0.044, 1e6, damping=1.0)
"""Properties of the rope."""
ALONG_X = poses.rotation_between(np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0]))
"""Orientation of a grip that holds the rope along x."""
LEFT_GRIP = Pose(np.array([-0.17, 0.0, 0.4]), ALONG_X)
RIGHT_GRIP = Pose(np.array([0.17, 0.0, 0.4]), ALONG_X)
"""Grips at the start."""

NodePath = Float64[np.ndarray, "H n 3"]
"""Node positions after every action [m]."""
Moves = Float64[np.ndarray, "H 2 6"]
"""Velocities of both grips in every action [m/s, rad/s]."""


class Simulation(Protocol):
    """Rope of a solver at the start of a motion, with everything prepared that is not a step."""

    def run(self) -> NodePath:
        """Return the positions after every action; called once."""
        ...

    def settle(self) -> Float64[np.ndarray, "n 3"]:
        """Return the positions at rest between the grips at the end; called after `run`."""
        ...


@dataclass(frozen=True)
class Contender:
    """Solver with one setting."""

    solver: str
    """Name of the solver."""
    nodes: int
    """Number of nodes n."""
    setting: str
    """Steps, sub-steps or sweeps."""
    start: Callable[[Moves], Simulation]
    """Preparation of a simulation of given moves."""


def actions() -> Moves:
    """Return the velocities of both grips."""
    t = (np.arange(ACTION_COUNT) + 0.5) * ACTION_DURATION
    bell = np.where(t < 0.5, np.sin(np.pi * t / 0.5) ** 2, 0.0)
    moves = np.zeros((ACTION_COUNT, 2, 6))
    moves[:, 1] = bell[:, None] * np.array([-0.3, 0.4, 0.2, 6.0, 0.0, 2.0])
    return moves


def then_still(moves: Moves) -> Moves:
    """Return moves after which the grips stand still until the rope is at rest."""
    return np.concatenate([moves, np.zeros((SETTLING_COUNT, 2, 6))])


@functools.cache
def rest_state(node_count: int) -> RodState:
    """Return the state in which every solver starts: the rod at rest."""
    return Rod(PROPERTIES, node_count).rest(LEFT_GRIP, RIGHT_GRIP).state


def grip_path(
    moves: Moves, step: float
) -> tuple[Float64[np.ndarray, "K 2 3"], Float64[np.ndarray, "K 2 4"]]:
    """Return positions [m] and orientations (wxyz) of both grips after every step [s]."""
    count = round(ACTION_DURATION / step)
    times = step * np.arange(1, count + 1)[:, None, None]
    positions = np.array([grip.position for grip in (LEFT_GRIP, RIGHT_GRIP)])
    orientations = np.array([grip.orientation for grip in (LEFT_GRIP, RIGHT_GRIP)])
    path = np.empty((len(moves), count, 2, 3)), np.empty((len(moves), count, 2, 4))
    for k, action in enumerate(moves):
        path[0][k] = positions + times * action[:, :3]
        path[1][k] = poses.multiply(poses.exponential(times * action[:, 3:]), orientations)
        positions, orientations = path[0][k, -1], path[1][k, -1]
    return path[0].reshape(-1, 2, 3), path[1].reshape(-1, 2, 4)


def final_grips(moves: Moves) -> tuple[Pose, Pose]:
    """Return the grips after all moves."""
    positions, orientations = grip_path(moves, ACTION_DURATION)
    left, right = (Pose(positions[-1, k], orientations[-1, k]) for k in range(2))
    return left, right
