"""Detection of a rope that hangs on an unknown obstacle.

There are two signs, each of which must last. The rope stays behind: its nodes hardly move while the
nodes of the model, which hangs free, follow the grips. On a support, friction, which the model
lacks, holds a rope back as well, and only the second sign counts. The rope is taut:
the straight lines from both grips to a node are together as long as the rope, while the model has
slack there; a free rope is never both taut and off the line between its grips. A wrong stiffness
causes neither sign.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np
from jaxtyping import Bool, Float64

WINDOW = 400_000_000
"""Duration over which motion is compared [ns]."""
MIN_MODEL_MOTION = 0.03
"""Least motion of a node of the model that is compared [m]."""
MAX_MOTION_SHARE = 0.35
"""Motion below which a node stays behind, as a share of the model's motion [-]."""
MIN_GROWTH = 0.02
"""Least growth of the distance between a node that stays behind and the model's [m]."""
TAUT_SLACK = 0.01
"""Slack below which the rope is taut, as a share of its length [-]."""
MODEL_SLACK = 0.02
"""Slack that the model must have beyond the rope's, as a share of the length [-]."""
ADJACENT_NODES = 3
"""Adjacent nodes that must show the same sign."""
OBSERVATIONS = 4
"""Successive observations that must show a sign."""


@dataclass(frozen=True)
class Snag:
    """Place where the rope hangs on something."""

    sign: Literal["stays_behind", "taut"]
    """Sign by which it was found."""
    position: Float64[np.ndarray, "3"]
    """Node in the middle of those that show the sign [m]."""


class SnagDetector:
    """Detector that compares the observed rope with the model."""

    def __init__(self) -> None:
        """Create a detector without observations."""
        self.reset()

    def reset(self) -> None:
        """Drop all observations."""
        self._past: deque[tuple[int, np.ndarray, np.ndarray]] = deque()
        self._signs = 0

    def observe(
        self,
        stamp: int,
        nodes: Float64[np.ndarray, "n 3"],
        model: Float64[np.ndarray, "n 3"],
        observed: Bool[np.ndarray, "n"],
        length: float,
        *,
        leaning: bool = False,
    ) -> Snag | None:
        """Take in an observation; return a snag once its sign has lasted.

        Args:
            stamp: Time of the observation [ns].
            nodes: Observed nodes [m].
            model: Nodes of the model at the same time [m].
            observed: Nodes that were seen, not bridged.
            length: Length of the rope, as it is known by now [m].
            leaning: Whether the rope leans on a support, where friction may hold it back.
        """
        self._past.append((stamp, nodes, model))
        while len(self._past) > 2 and stamp - self._past[1][0] >= WINDOW:
            self._past.popleft()
        sign: Literal["stays_behind", "taut"] = "stays_behind"
        node = None if leaning else self._node_behind(nodes, model, observed)
        if node is None:
            sign, node = "taut", self._taut_node(nodes, model, observed, length)
        self._signs = 0 if node is None else self._signs + 1
        if node is None or self._signs < OBSERVATIONS:
            return None
        return Snag(sign, nodes[node])

    def _node_behind(
        self,
        nodes: Float64[np.ndarray, "n 3"],
        model: Float64[np.ndarray, "n 3"],
        observed: Bool[np.ndarray, "n"],
    ) -> int | None:
        """Middle one of the nodes that stay behind the model."""
        stamp, nodes_before, model_before = self._past[0]
        if self._past[-1][0] - stamp < WINDOW:
            return None
        expected = np.linalg.norm(model - model_before, axis=1)
        if np.max(expected) <= MIN_MODEL_MOTION:
            return None
        moved = np.linalg.norm(nodes - nodes_before, axis=1)
        growth = np.linalg.norm(nodes - model, axis=1)
        growth = growth - np.linalg.norm(nodes_before - model_before, axis=1)
        return self._middle(
            observed
            & (expected > MIN_MODEL_MOTION)
            & (moved < MAX_MOTION_SHARE * expected)
            & (growth > MIN_GROWTH)
        )

    def _taut_node(
        self,
        nodes: Float64[np.ndarray, "n 3"],
        model: Float64[np.ndarray, "n 3"],
        observed: Bool[np.ndarray, "n"],
        length: float,
    ) -> int | None:
        """Middle one of the nodes at which the rope is taut and the model is not."""
        slack = length - _path_lengths(nodes, model)
        taut = slack < TAUT_SLACK * length
        if not taut.any():
            return None
        expected = length - _path_lengths(model, model)
        model_slack = expected > slack + MODEL_SLACK * length
        return self._middle(observed & taut & model_slack)

    def _middle(self, chosen: Bool[np.ndarray, "n"]) -> int | None:
        """Middle of the longest sequence of chosen nodes, if that is long enough."""
        if not chosen.any():
            return None
        edges = np.flatnonzero(np.diff(np.concatenate([[False], chosen, [False]]).astype(int)))
        runs = [(b - a, (a + b) // 2) for a, b in pairwise(edges.tolist())][::2]
        longest, middle = max(runs, default=(0, 0))
        return middle if longest >= ADJACENT_NODES else None


def _path_lengths(
    nodes: Float64[np.ndarray, "n 3"], model: Float64[np.ndarray, "n 3"]
) -> Float64[np.ndarray, "n"]:
    """Length of the straight lines from both grips, the model's ends, to each node [m]."""
    left, right = (np.linalg.norm(nodes - grip, axis=1) for grip in model[[0, -1]])
    return left + right
