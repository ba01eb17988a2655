"""Checks of the arms' feedback while they may move: what is measured must keep the rules too."""

from __future__ import annotations

from typing import NamedTuple

from lariat.safety.constraints.path_check import MEASURED_TOLERANCE
from lariat.safety.constraints.rule import Rule
from lariat.safety.guard.force_limit import ForceLimit
from lariat.safety.motion.chunk_check import EXCESS_UNITS
from lariat.safety.motion.command_history import LEVER_ARM
from lariat.safety.motion.follower import SetpointFollower
from lariat.scenario import SIDES
from services.robot_gateway.arms import Arms


class Finding(NamedTuple):
    """Reason to stop that the feedback gives."""

    cause: str
    """Row of the table of stop causes."""
    detail: str
    """The cause in words, with numbers."""
    rule: Rule | None = None
    """Rule that is broken, where the cause does not name it."""


class FeedbackChecks:
    """Deviation from the path, rules for the measured poses and joints, contact forces."""

    def __init__(self, arms: Arms, follower: SetpointFollower, force_limit: ForceLimit) -> None:
        self._arms = arms
        self._follower = follower
        self._force_limit = force_limit

    def acknowledge(self) -> None:
        """Allow the present contact forces, which a person has seen."""
        self._force_limit.acknowledge(self._arms.contact_forces)

    def find(self) -> Finding | None:
        """Return the first reason to stop in the newest feedback, if any."""
        return self._off_path() or self._broken_by_arms() or self._pulled()

    def _off_path(self) -> Finding | None:
        errors, near = self._arms.tracking_errors(), self._arms.within_tracking_limit(1.0)
        for name, (distance, angle), close in zip(SIDES, errors, near, strict=False):
            if not close:
                words = f"{name}: {1e3 * distance:.0f} mm and {angle:.2f} rad off its command"
                return Finding("tracking", words)
        return None

    def _broken_by_arms(self) -> Finding | None:
        # The commands have kept the rules: an arm that is on their path keeps them as well.
        off = [distance + LEVER_ARM * angle for distance, angle in self._arms.tracking_errors()]
        if max(off) <= MEASURED_TOLERANCE:
            return None
        feedback = [self._arms.feedback[k] for k in self._follower.driven]
        grips = [f.pose for f in feedback if f.pose is not None]
        if len(grips) < len(feedback):
            return None
        broken = self._follower.paths.broken_by_arms(
            self._follower.state, grips, [f.joints for f in feedback]
        )
        if broken is None:
            return None
        rule, excess = broken
        words = f"the arms break {rule} by {excess:.4f} {EXCESS_UNITS.get(rule, 'm')}"
        return Finding("measured", f"{words}, their commands do not", rule)

    def _pulled(self) -> Finding | None:
        forces = self._arms.contact_forces
        end = self._force_limit.exceeded(forces)
        if end is None:
            return None
        felt = f"{SIDES[end]} feels {forces[end]:.0f} N more than at rest"
        return Finding("pulled", f"{felt}; limits.pull is {self._force_limit.limit:.0f} N")
