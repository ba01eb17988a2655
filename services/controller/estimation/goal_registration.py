"""Goal laid along a rope whose length, and whose place in the grips, are not known exactly.

A goal is a curve. Neither images nor the rope's shape tell how far it has been pushed through its
grips, so that nodes of goal and model that lie at the same place of a rope may not face each other.
Without sliding, the rope would leave the curve to bring them nearer.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float64

from lariat.geometry import polylines
from services.controller.estimation.observation_registration import distances_along, slid_nodes


def goal_along_rope(
    goal: Float64[np.ndarray, "n 3"],
    rope: Float64[np.ndarray, "n 3"],
    length: float,
    max_slip: float,
) -> Float64[np.ndarray, "n 3"]:
    """Return the points of a goal that face the nodes of a rope [m].

    The difference of the lengths stands out at both ends; the goal slides along itself, as a whole,
    to where it is nearest to the rope.

    Args:
        goal: Nodes of the goal [m].
        rope: Nodes of the rope [m].
        length: Length of the rope [m].
        max_slip: Largest distance by which the goal slides, apart from half the difference of the
            lengths [m].
    """
    excess = length - polylines.length(goal)
    spread = excess * np.linspace(-0.5, 0.5, len(goal))
    most = max_slip + 0.5 * abs(excess)
    slip = float(np.mean(distances_along(goal, rope) - spread))
    return slid_nodes(goal, spread + np.clip(slip, -most, most))
