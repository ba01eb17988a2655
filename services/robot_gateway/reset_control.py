"""Control of a reset: the arms go back to the scenario's start, in simulation only."""

from __future__ import annotations

from lariat.reset_counter import ResetCounter
from lariat.safety.motion.follower import SetpointFollower
from services.robot_gateway.arms import Arms


class ResetControl:
    """Resets of a cell, each carried out once everything rests."""

    def __init__(self, arms: Arms, follower: SetpointFollower) -> None:
        self._arms = arms
        self._follower = follower
        self._counter = ResetCounter()
        self._placing = False
        """Whether the arms are being put at the start."""
        self.pending = False
        """Whether a reset is requested and not finished."""
        self.done = 0
        """Count of the reset that was carried out last; 0 while it is not known."""

    def request(self, count: int) -> None:
        """Take the controller's count of resets, and stop the motion for a new one."""
        if self._counter.advanced(count):
            self.pending = True
            self._follower.halt()
        if not self.pending:
            self.done = self._counter.known

    def begin(self) -> bool:
        """Put arms that rest at the start for a reset; return whether that has just begun."""
        if not self.pending or self._placing:
            return False
        self._placing = True
        self._arms.place_at_start(range(len(self._arms.drivers)))
        self._follower.place(self._arms.grips)
        return True

    def finish(self) -> None:
        """State a reset once the arms report the start: the rope is put back with that message."""
        if self._placing and self._arms.at_start:
            self.pending = self._placing = False
            self.done = self._counter.known
