"""Slack of each rule along a path: positive where the rule is kept.

A rule that is already broken, because an obstacle appeared or the rope was laid out too tight, does
not freeze the arm: motion that makes it worse nowhere is permitted.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float64

from lariat.safety.constraints.rule import Rule

Slacks = dict[Rule, Float64[np.ndarray, "m"]]
"""Slack of each rule at m poses of a path [m, or rad for joints]."""

SLACK_TOLERANCE = 1e-6
"""Slack that may be missing before a rule counts as broken [m, rad]."""


def first_broken(slacks: Slacks, margin: float = 0.0) -> tuple[Rule, float] | None:
    """Return the first rule that a path breaks, and by how much [m, rad].

    Args:
        slacks: Slacks of a path whose first pose is the present one.
        margin: Slack that is demanded beyond zero [m, rad].
    """
    for rule, slack in slacks.items():
        least = float(np.minimum.reduce(slack[1:], initial=np.inf))
        # Fail closed: a slack that is not a number breaks its rule.
        if not least >= min(margin, float(slack[0])) - SLACK_TOLERANCE:
            return rule, margin - least
    return None
