"""Force limit: detects a taut or caught rope independently of the geometric constraints.

As with every rule, a broken limit may only improve: a contact force that a person has acknowledged
may not grow, and once it is below the limit the limit holds again.
"""

from __future__ import annotations

from collections.abc import Sequence

FORCE_MARGIN = 2.0
"""Force by which an acknowledged contact force may fluctuate [N]."""


class ForceLimit:
    """Limit on the contact force at every gripper."""

    def __init__(self, limit: float) -> None:
        """Create the limit.

        Args:
            limit: Largest change of the force since the arm was armed at rest [N].
        """
        self.limit = limit
        self._allowed: list[float] = []

    def acknowledge(self, forces: Sequence[float]) -> None:
        """Allow the present contact forces, which a person has seen [N]."""
        self._allowed = [f + FORCE_MARGIN if f > self.limit else 0.0 for f in forces]

    def exceeded(self, forces: Sequence[float]) -> int | None:
        """Return the first end whose contact force is too large, if any.

        Args:
            forces: Contact force at each end [N].
        """
        allowed = self._allowed or [0.0] * len(forces)
        for k, force in enumerate(forces):
            # Fail closed: a force that is not a number exceeds the limit.
            if not force <= max(self.limit, allowed[k]):
                return k
            if allowed[k] and force <= self.limit:
                allowed[k] = 0.0
            elif allowed[k]:
                allowed[k] = min(allowed[k], force + FORCE_MARGIN)
        self._allowed = list(allowed)
        return None
