"""Reasons for the state of a run and for holding the arms, and their text."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum, auto


class ReasonCode(Enum):
    """Reason of a decision; those of the task's state are named as in `TaskState.Reason`."""

    # Reasons of the task's state.
    WAITING_FOR_START = auto()
    STARTED = auto()
    SCHEDULED_GOAL = auto()
    NEXT_GOAL = auto()
    SETTLED = auto()
    PAUSE_REQUESTED = auto()
    STOP_REQUESTED = auto()
    RESET_REQUESTED = auto()
    LEFT_GOAL = auto()
    SNAG_STAYS_BEHIND = auto()
    SNAG_TAUT = auto()
    SLIPPED = auto()
    PULLED = auto()
    STALLED = auto()
    PATH_ENDS_SHORT = auto()
    NO_PATH = auto()
    PATH_NOT_FOLLOWED = auto()
    CONTACT_EXPECTED = auto()
    METHOD_FAULT = auto()
    # Reasons to hold the arms or to brake while the task goes on.
    ARMS_UNAVAILABLE = auto()
    WAITING_FOR_RESET = auto()
    ROPE_NOT_SEEN = auto()
    ROPE_DOUBTFUL = auto()
    SETPOINTS_REFUSED = auto()
    ARM_OFF_COURSE = auto()
    APPROACHING_OBSTACLE = auto()
    COMING_TO_REST = auto()
    WAITING_FOR_PATH = auto()
    PATH_OUTDATED = auto()
    CLEARANCE_UNCERTAIN = auto()
    PATH_STARTS_ELSEWHERE = auto()
    WAITING_FOR_OBSTACLE = auto()
    DEPARTURE_MISSED = auto()
    LEARNING_MATERIAL = auto()
    WAITING_FOR_GRIPS = auto()


TEXTS: Mapping[ReasonCode, str] = {
    ReasonCode.WAITING_FOR_START: "waiting for a start",
    ReasonCode.STARTED: "started",
    ReasonCode.SCHEDULED_GOAL: "the goal changed {seconds:g} s into the run",
    ReasonCode.NEXT_GOAL: "goal {number} of {count}, the one before it was reached",
    ReasonCode.SETTLED: "within tolerance and at rest",
    ReasonCode.PAUSE_REQUESTED: "paused by a person",
    ReasonCode.STOP_REQUESTED: "stopped by a person",
    ReasonCode.RESET_REQUESTED: "reset",
    ReasonCode.LEFT_GOAL: "the rope has left the goal, {error_mm:.0f} mm; start again",
    ReasonCode.SNAG_STAYS_BEHIND: (
        "the rope hangs on something near [{x:.2f}, {y:.2f}, {z:.2f}] m: it stays behind while the "
        "grips move; free it, then start again"
    ),
    ReasonCode.SNAG_TAUT: (
        "the rope hangs on something near [{x:.2f}, {y:.2f}, {z:.2f}] m: it is taut round it; free "
        "it, then start again"
    ),
    ReasonCode.SLIPPED: (
        "the rope has slipped out of the {side} grip, its end is {distance_mm:.0f} mm away; grip "
        "it again, then start again"
    ),
    ReasonCode.PULLED: (
        "the rope is pulled with {tension_n:.2f} N (limits.tension = {limit_n:g} N); slacken it, "
        "then start again"
    ),
    ReasonCode.STALLED: "stalled {error_mm:.1f} mm from the goal on average, {why}",
    ReasonCode.PATH_ENDS_SHORT: "{answer}",
    ReasonCode.NO_PATH: "{answer}",
    ReasonCode.PATH_NOT_FOLLOWED: (
        "{cause}; {paths} new paths, the last with {margin_mm:.0f} mm more clearance, did not help"
    ),
    ReasonCode.CONTACT_EXPECTED: (
        "stopped {clearance_mm:.1f} mm before obstacle {obstacle!r}: the rope is expected within "
        "{predicted_mm:.1f} mm of it, known to {deviation_mm:.1f} mm; {paths} new paths did not "
        "help. It needs {needed_mm:.0f} mm more room there, or a rope that is known better"
    ),
    ReasonCode.METHOD_FAULT: "{problem}; the arms hold",
    ReasonCode.ARMS_UNAVAILABLE: "the arms do not follow: {state}",
    ReasonCode.WAITING_FOR_RESET: "waiting for the arms to reset",
    ReasonCode.ROPE_NOT_SEEN: "the rope has not been seen for {seconds:g} s",
    ReasonCode.ROPE_DOUBTFUL: (
        "the rope has not been told from what lies beside it for {seconds:g} s (what is seen is "
        "another shape or rope with probability {p_wrong:.2f}); move the other away"
    ),
    ReasonCode.SETPOINTS_REFUSED: "the gateway refuses the path ({refusal})",
    ReasonCode.ARM_OFF_COURSE: "an arm is {error_mm:.0f} mm from where it should be",
    ReasonCode.APPROACHING_OBSTACLE: (
        "stopping before obstacle {obstacle!r}: expected within {predicted_mm:.1f} mm, known to "
        "{deviation_mm:.1f} mm"
    ),
    ReasonCode.COMING_TO_REST: "coming to rest before another path",
    ReasonCode.WAITING_FOR_PATH: "waiting for a path",
    ReasonCode.PATH_OUTDATED: "the rope has turned out to be another one; waiting for a path",
    ReasonCode.CLEARANCE_UNCERTAIN: (
        "with a probability of 99 % the path keeps only {certain_mm:.1f} mm from obstacles "
        "(control.certain_clearance = {limit_mm:g} mm)"
    ),
    ReasonCode.PATH_STARTS_ELSEWHERE: "the path begins elsewhere; waiting for another",
    ReasonCode.WAITING_FOR_OBSTACLE: "waiting {seconds:.1f} s for a moving obstacle to pass",
    ReasonCode.DEPARTURE_MISSED: "too late to pass a moving obstacle; waiting for another path",
    ReasonCode.LEARNING_MATERIAL: "learning the rope before it is moved",
    ReasonCode.WAITING_FOR_GRIPS: "waiting for the grips: {problem}",
}
"""Text of every reason; fields in braces are its detail."""


@dataclass(frozen=True)
class Reason:
    """Reason with the values of its text."""

    code: ReasonCode
    detail: Mapping[str, object] = field(default_factory=dict)
    """Values of the fields of its text; names carry the unit."""

    def __str__(self) -> str:
        return TEXTS[self.code].format_map(self.detail)
