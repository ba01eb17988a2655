"""Perception of one's own: bright pixels along the line between the grips."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from lariat.geometry import polylines
from lariat.protocols import PerceptionSetup, RopeEstimate


class Bright:
    """Bright pixels, sorted along the line between the grips; for a rope that hangs freely."""

    def __init__(self, setup: PerceptionSetup) -> None:
        self.setup = setup

    def reset(self) -> None:
        """Forget the run before; this perception has no memory."""

    def locate(self, color, depth, grips, time) -> RopeEstimate | None:
        left, right = grips
        rows, columns = np.nonzero((color.mean(axis=2) > 128) & (depth > 0))
        if left is None or right is None or len(rows) < 100:
            return None
        pixels = np.stack([columns, rows], axis=1).astype(float)
        points = self.setup.camera.back_project(pixels, 1e-3 * depth[rows, columns])
        chord = right.position - left.position
        share = (points - left.position) @ chord / (chord @ chord)
        bins = np.linspace(0.0, 1.0, 41)
        groups = [points[(share >= a) & (share < b)] for a, b in pairwise(bins)]
        line = [np.median(group, axis=0) for group in groups if len(group) > 5]
        chain = np.array([left.position, *line, right.position])
        n = self.setup.node_count
        nodes = polylines.resample_smooth(chain, n)
        return RopeEstimate(nodes, np.full(n, 0.004), np.ones(n, dtype=bool))
