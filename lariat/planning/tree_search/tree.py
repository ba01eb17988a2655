"""Tree of shapes that a rope takes one after the other, from its root."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float64, Int64

from lariat.planning.tree_search.grip_motion import GripMotion, Grips
from lariat.rod import RodState


class ShapeTree:
    """Nodes of a tree: grips, the rod between them, and the node from which each is reached."""

    def __init__(self, motion: GripMotion, grips: Grips, state: RodState) -> None:
        """Create the tree with its root."""
        self._motion = motion
        self._capacity = 256
        self._positions = np.zeros((self._capacity, 2, 3))
        self._orientations = np.zeros((self._capacity, 2, 4))
        self.states: list[RodState] = []
        """Rod at each node."""
        self._parents: list[int] = []
        self.add(-1, grips, state)

    def __len__(self) -> int:
        return len(self.states)

    def add(self, parent: int, grips: Grips, state: RodState) -> int:
        """Add one node; return its index."""
        index = len(self.states)
        if index == self._capacity:
            self._positions = np.concatenate([self._positions, np.zeros_like(self._positions)])
            self._orientations = np.concatenate(
                [self._orientations, np.zeros_like(self._orientations)]
            )
            self._capacity *= 2
        self._positions[index] = grips.positions[0]
        self._orientations[index] = grips.orientations[0]
        self.states.append(state)
        self._parents.append(parent)
        return index

    @property
    def grips(self) -> Grips:
        """Grips of all nodes."""
        count = len(self)
        return Grips(self._positions[:count], self._orientations[:count])

    def nearest(self, targets: Grips, turning: bool) -> Int64[np.ndarray, "k"]:
        """Return the node nearest to each target.

        Args:
            turning: Whether the orientations of the targets count.
        """
        here = Grips(self.grips.positions[None], self.grips.orientations[None])
        there = Grips(targets.positions[:, None], targets.orientations[:, None])
        return np.argmin(self._motion.length(here, there, turning), axis=1)

    def branch(self, index: int) -> list[int]:
        """Return the nodes from the root to a node."""
        nodes = [index]
        while self._parents[nodes[-1]] >= 0:
            nodes.append(self._parents[nodes[-1]])
        return nodes[::-1]

    def mean_distances(self, nodes: Float64[np.ndarray, "n 3"]) -> Float64[np.ndarray, "k"]:
        """Return the mean node distance of each shape from another one [m]."""
        shapes = np.stack([state.positions for state in self.states])
        return np.mean(np.linalg.norm(shapes - nodes, axis=2), axis=1)
