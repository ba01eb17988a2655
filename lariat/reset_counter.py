"""Resets of a simulated cell, as its processes hear of them.

The controller counts the resets that people request; the gateway states the one that it carried out
last. A count of 0 says that its sender does not know the count yet: it has just started. The count
that a process hears first is where the cell stands, so that a restart of a process resets nothing.
"""

from __future__ import annotations


class ResetCounter:
    """Follower of a sender's count of resets."""

    def __init__(self) -> None:
        self.known = 0
        """Count heard last; 0 before the first."""

    def advanced(self, count: int) -> bool:
        """Take a count, and return whether a reset has been added to the one before.

        Args:
            count: Count of the sender; 0 where it does not know it.
        """
        added = 0 < self.known < count
        self.known = count or self.known
        return added
