"""Table of the causes of a stop.

`docs/concepts/safety.md` shows it, the state machine uses it, and tests check every row.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from lariat.safety.constraints.rule import Rule

StopKind = Literal["none", "jerk-limited", "by the arm", "undocumented"]
Resumption = Literal[
    "by itself", "after resuming", "after an approach", "after acknowledgement", "after arming"
]
"""Condition for moving again; after an acknowledgement a person must also resume."""


@dataclass(frozen=True)
class StopCause:
    """Row of the table."""

    description: str
    """Event that stops the cell."""
    detection: str
    """Means of detection, and the time that it takes."""
    stop: StopKind
    """Way in which the commanded motion ends."""
    resumes: Resumption
    """Condition for moving again."""
    rule: Rule | None = None
    """Rule that is broken, if any."""


STOP_CAUSES: dict[str, StopCause] = {
    "boot": StopCause("the gateway started", "at once", "none", "after arming"),
    "disarm": StopCause(
        "a person disarms", "at the next tick, 8 ms", "jerk-limited", "after arming"
    ),
    "acknowledged": StopCause(
        "a person has acknowledged a stop",
        "at once",
        "none",
        "after resuming",
    ),
    "consent": StopCause(
        "the person who lets the arms approach the start has released the button",
        "80 ms after the last sign of life",
        "jerk-limited",
        "after an approach",
    ),
    "unfinished_approach": StopCause(
        "a person has acknowledged a stop on the way to the start",
        "at once",
        "none",
        "after an approach",
    ),
    "person": StopCause(
        "a person holds", "at the next tick", "jerk-limited", "after acknowledgement"
    ),
    "writer_holds": StopCause(
        "the controller holds (paused, rope lost)",
        "at the next tick",
        "jerk-limited",
        "by itself",
    ),
    "silence": StopCause(
        "no fresh setpoints: controller, bus or network dead or stopped",
        "brakes 50 ms after the last chunk's receipt, holds after 100 ms",
        "jerk-limited",
        "after acknowledgement",
        "fresh",
    ),
    "new_writer": StopCause(
        "setpoints of another writer session (the controller was restarted)",
        "at its first chunk, 0.5 s after the former writer's last one",
        "jerk-limited",
        "after acknowledgement",
        "ordered",
    ),
    "second_gateway": StopCause(
        "another gateway publishes the state of this cell's arms",
        "at its first message",
        "jerk-limited",
        "after acknowledgement",
    ),
    "refused": StopCause(
        "a chunk breaks a rule",
        "when it arrives",
        "none",
        "by itself",
    ),
    "boundary": StopCause(
        "the stop after the next step would break a rule (an obstacle appeared, the rope is taut)",
        "before the step is taken",
        "jerk-limited",
        "by itself",
    ),
    "left_behind": StopCause(
        "the command fell too far behind its chunk",
        "at the next tick",
        "jerk-limited",
        "by itself",
        "step",
    ),
    "stalled": StopCause(
        "the gateway was suspended for more than 100 ms",
        "at the first tick after; the guard of a moving CR5 stops it after 100 ms",
        "by the arm",
        "after acknowledgement",
        "fresh",
    ),
    "slow": StopCause(
        "`silence`, `stalled`, late feedback, or `tracking` after a gap of 40 ms in the feedback, "
        "in a cell that reaches no real arm: the computer was too slow",
        "as those",
        "jerk-limited",
        "by itself",
        "fresh",
    ),
    "tracking": StopCause(
        "the arm is not where it is commanded to be",
        "from its feedback, 8 ms",
        "jerk-limited",
        "after acknowledgement",
        "step",
    ),
    "measured": StopCause(
        "measured poses or joints break a rule that the commands keep",
        "from their feedback, 8 ms",
        "jerk-limited",
        "after acknowledgement",
    ),
    "pulled": StopCause(
        "the contact force of an arm exceeds its limit: the rope is taut or caught",
        "from its feedback, mean over 0.1 s",
        "jerk-limited",
        "after acknowledgement",
        "overstretch",
    ),
    "alarm": StopCause(
        "the arm reports an alarm, a collision, an emergency stop, power off, a blocked queue or "
        "another operator; its guard has stopped it",
        "from its feedback, 8 ms",
        "by the arm",
        "after acknowledgement",
    ),
    "lost_link": StopCause(
        "no feedback of the arm for 100 ms, or a socket closed",
        "100 ms",
        "by the arm",
        "after acknowledgement",
        "lost_link",
    ),
    "gateway_dies": StopCause(
        "the gateway process dies",
        "at once, by the guard of a CR5",
        "by the arm",
        "after arming",
    ),
}


def markdown() -> str:
    """Return the table as it stands in `docs/concepts/safety.md`."""
    head = "| cause | description | detection | stop | resumes |\n|---|---|---|---|---|"
    rows = [
        f"| `{name}` | {c.description} | {c.detection} | {c.stop} | {c.resumes} |"
        for name, c in STOP_CAUSES.items()
    ]
    return "\n".join([head, *rows])
