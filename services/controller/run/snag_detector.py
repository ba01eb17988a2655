"""Notices a rope that hangs on something which the model does not know of.

Two signs, each of which must last. Staying behind: nodes hardly move while the model's, which hang
free or lean on known supports, go along with the grips. Taut round a corner: the straight ways from
the grips to a node are as long as the rope while the model has slack there; a rope that hangs free
is never both taut and off the line between its grips. A wrong stiffness shows neither.
"""

from __future__ import annotations

from collections import deque
from itertools import pairwise

import numpy as np
from jaxtyping import Bool, Float64

WINDOW = 400_000_000
"""Over which motion is compared [ns]."""
MOVED = 0.03
"""Least motion of the model's nodes that tells anything [m]."""
BEHIND = 0.35
"""Of that motion: nodes that moved less stay behind [-]."""
APART = 0.02
"""Least growth of the distance between a node and the model's that stays behind [m]."""
TAUT = 0.01
"""Slack below which a rope is taut, as a share of its length [-]."""
SLACK = 0.02
"""Slack that the model must have beyond that, as a share of the rope's length [-]."""
NEIGHBOURS = 3
"""Adjacent nodes that must agree."""
LASTING = 4
"""Observations in a row that must show the same."""


class SnagDetector:
    """Compares what is seen of one rope with what the model does."""

    def __init__(self, length: float) -> None:
        """Args: length: Of the rope [m]."""
        self.length = length
        self.begin()

    def begin(self) -> None:
        """Forgets what was seen."""
        self._past: deque[tuple[int, np.ndarray, np.ndarray]] = deque()
        self._signs = 0

    def look(
        self,
        stamp: int,
        seen: Float64[np.ndarray, "n 3"],
        modelled: Float64[np.ndarray, "n 3"],
        observed: Bool[np.ndarray, "n"],
    ) -> str:
        """Takes in an observation of `stamp` [ns]; says where the rope hangs when it does.

        Args:
            seen: Nodes as observed [m].
            modelled: Nodes of the model at the same instant [m].
            observed: Which of the seen nodes count.
        """
        self._past.append((stamp, seen, modelled))
        while len(self._past) > 2 and stamp - self._past[1][0] >= WINDOW:
            self._past.popleft()
        at = self._behind(seen, modelled, observed)
        sign = "stays behind while the grips move"
        if at is None:
            at, sign = self._taut(seen, modelled, observed), "is taut round it"
        self._signs = 0 if at is None else self._signs + 1
        if at is None or self._signs < LASTING:
            return ""
        place = ", ".join(f"{x:.2f}" for x in seen[at])
        return f"the rope hangs on something near [{place}] m: it {sign}; free it, then start again"

    def _behind(
        self,
        seen: Float64[np.ndarray, "n 3"],
        modelled: Float64[np.ndarray, "n 3"],
        observed: Bool[np.ndarray, "n"],
    ) -> int | None:
        """The middle one of the nodes that stay behind."""
        stamp, seen_then, modelled_then = self._past[0]
        if self._past[-1][0] - stamp < WINDOW:
            return None
        expected = np.linalg.norm(modelled - modelled_then, axis=1)
        moved = np.linalg.norm(seen - seen_then, axis=1)
        growth = np.linalg.norm(seen - modelled, axis=1)
        growth = growth - np.linalg.norm(seen_then - modelled_then, axis=1)
        stays = observed & (expected > MOVED) & (moved < BEHIND * expected) & (growth > APART)
        return _middle(stays)

    def _taut(
        self,
        seen: Float64[np.ndarray, "n 3"],
        modelled: Float64[np.ndarray, "n 3"],
        observed: Bool[np.ndarray, "n"],
    ) -> int | None:
        """The middle one of the nodes at which the rope is taut and the model is not."""
        slack, expected = (self._slack(nodes, modelled) for nodes in (seen, modelled))
        share = self.length
        return _middle(observed & (slack < TAUT * share) & (expected > slack + SLACK * share))

    def _slack(
        self, nodes: Float64[np.ndarray, "n 3"], modelled: Float64[np.ndarray, "n 3"]
    ) -> Float64[np.ndarray, "n"]:
        """What the rope is longer than the straight ways from the grips to each node [m]."""
        left, right = (np.linalg.norm(nodes - grip, axis=1) for grip in modelled[[0, -1]])
        return self.length - left - right


def _middle(chosen: Bool[np.ndarray, "n"]) -> int | None:
    """Middle of the longest run of chosen nodes, if that is long enough."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], chosen, [False]]).astype(int)))
    runs = [(b - a, (a + b) // 2) for a, b in pairwise(edges.tolist())][::2]
    longest, middle = max(runs, default=(0, 0))
    return middle if longest >= NEIGHBOURS else None
