"""Tree of shapes that a rope takes one after the other, from its root."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float64, Int64

from lariat.geometry.grips import Grips
from lariat.planning.tree_search.grip_motion import GripMotion
from lariat.rod import RodState


class ShapeTree:
    """Nodes of a tree: grips, the rod between them, and the node from which each is reached."""

    def __init__(self, motion: GripMotion, grips: Grips, state: RodState) -> None:
        """Create the tree with its root."""
        self._motion = motion
        self.grips = grips
        """Grips of all nodes."""
        self.states = [state]
        """Rod at each node."""
        self._parents = [-1]

    def __len__(self) -> int:
        return len(self.states)

    def add(self, parent: int, grips: Grips, states: Sequence[RodState]) -> int:
        """Add a branch of nodes; return the last of them, or its parent if there are none."""
        if not states:
            return parent
        first = len(self)
        self.grips = Grips.joined(self.grips, grips)
        self.states += states
        self._parents += [parent, *range(first, first + len(states) - 1)]
        return len(self) - 1

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
