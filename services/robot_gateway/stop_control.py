"""Control of stops: the safety state of a cell, and the command that it stops."""

from __future__ import annotations

from lariat.safety.constraints.rule import Rule
from lariat.safety.guard.state_machine import SafetyState
from lariat.safety.guard.stop_causes import STOP_CAUSES
from lariat.safety.motion.follower import SetpointFollower


class StopControl:
    """Safety state of a cell; every stop halts the command of all arms."""

    def __init__(self, follower: SetpointFollower, boot: str) -> None:
        self._follower = follower
        self.safety = SafetyState(boot)
        """Safety state of the cell."""
        self.rule: Rule | None = None
        """Rule that was broken last."""
        self.waiting_since: int | None = None
        """Time since which the cell waits for arms to become ready [ns]."""
        self.stalled = False
        """Whether the gateway was suspended, so that the rest of the motion is not sent."""

    def stop(self, cause: str, detail: str, rule: Rule | None = None) -> None:
        """Stop all arms; the rule is named where the cause, of `STOP_CAUSES`, does not."""
        self.safety = self.safety.stopped(cause, detail)
        self.rule = rule or STOP_CAUSES[cause].rule or self.rule
        self._follower.halt()

    def wait_for_arms(self, now: int) -> None:
        """Begin to wait at `now` [ns] for the arms to become ready."""
        self.waiting_since = now
        self.rule = None

    def end_waiting(self) -> None:
        """Wait for no arm any more; what a suspended gateway had to send is void."""
        self.waiting_since, self.stalled = None, False
