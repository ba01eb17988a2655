"""Which arm is pulled too hard: the rope is taut or caught, whatever the geometry says.

As with every rule, what is already broken may only get better: after a person has acknowledged,
a pull may not grow beyond what it was then, and falls under the limit for good once it is there.
"""

from __future__ import annotations

from collections.abc import Sequence

MARGIN = 2.0
"""By which an acknowledged pull may still sway [N]."""


class Pulls:
    """Limits on the pull at every gripper."""

    def __init__(self, limit: float) -> None:
        """Args: limit: [N]."""
        self.limit = limit
        self._allowed: list[float] = []

    def acknowledge(self, pulls: Sequence[float]) -> None:
        """A person has seen what pulls now [N]."""
        self._allowed = [p + MARGIN if p > self.limit else 0.0 for p in pulls]

    def broken(self, pulls: Sequence[float]) -> int | None:
        """The first end that is pulled too hard."""
        allowed = self._allowed or [0.0] * len(pulls)
        for k, pull in enumerate(pulls):
            if pull > max(self.limit, allowed[k]):
                return k
            if allowed[k] and pull <= self.limit:
                allowed[k] = 0.0
            elif allowed[k]:
                allowed[k] = min(allowed[k], pull + MARGIN)
        self._allowed = list(allowed)
        return None
