"""Control of the approach: consent, plan and progress of the way to the scenario's start."""

from __future__ import annotations

from lariat.safety.guard.consent import HoldToRun
from lariat.safety.guard.operator_commands import CommandRejected, OperatorCommand
from lariat.safety.motion.approach import SETTINGS, is_as_named, plan_approach
from lariat.safety.motion.follower import SetpointFollower
from lariat.scenario import SIDES
from services.robot_gateway.arms import Arms


class ApproachControl:
    """The approach of a cell, which goes on only while a person consents."""

    def __init__(self, arms: Arms, follower: SetpointFollower, boot: str) -> None:
        self._arms = arms
        self._follower = follower
        self.consent = HoldToRun(boot)
        """Consent of the person."""
        self.wanted = False
        """Whether an approach begins as soon as the arms are ready."""
        self.running = False
        """Whether an approach is under way."""
        self.planned = False
        """Whether the last tick planned the approach, which takes long, while everything rested."""

    @property
    def active(self) -> bool:
        """Whether an approach is wanted or under way."""
        return self.wanted or self.running

    @property
    def arming_refusal(self) -> str:
        """Reason why the arms must approach the start before they are armed; empty at the start."""
        words = []
        for k in self._arms.ends_away_from_start:
            distance, angle = self._arms.distance_from_start_of(k)
            words.append(
                f"{SIDES[k]} is {1e3 * distance:.0f} mm and {angle:.2f} rad from the start"
            )
        if not words:
            return ""
        return (
            f"{', '.join(words)}; let it go there straight, at most at "
            f"{1e3 * SETTINGS.speed:.0f} mm/s, by an approach, or jog it there first"
        )

    def request(self, command: OperatorCommand, now: int) -> None:
        """Begin to wait for the arms, which must be where the command says they were seen."""
        present = self._arms.distance_from_start
        if not is_as_named((command.distance, command.angle), present):
            raise CommandRejected(
                f"names an approach of {_words(command.distance, command.angle)}, but it is "
                f"{_words(*present)}; look again"
            )
        self.wanted = True
        self.consent.begin(command.id, now)

    def start(self, now: int) -> None:
        """Follow the fastest approach that keeps every rule."""
        self.wanted, self.planned = False, True
        driven = self._follower.driven
        grips = [self._arms.grips[k] for k in driven]
        goals = [self._arms.starts[k] for k in driven]
        self._follower.follow(plan_approach(self._follower, grips, goals, now), now)
        self.running = True

    def end(self) -> None:
        """End the approach, wherever it is."""
        self.wanted = self.running = False


def _words(distance: float, angle: float) -> str:
    return f"{1e3 * distance:.0f} mm and {angle:.2f} rad"
