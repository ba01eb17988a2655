"""Operating modes and alarm numbers of the CR5, in words."""

from __future__ import annotations

MODE_TEXTS = {
    "v3": {
        1: "starting",
        2: "a brake is released",
        3: "no power",
        4: "disabled",
        5: "idle",
        6: "guided by hand",
        7: "running",
        8: "recording a hand-guided path",
        9: "in alarm",
        10: "paused",
        11: "being jogged",
    },
    "v4": {
        1: "starting",
        2: "a brake is released",
        3: "no power",
        4: "disabled",
        5: "idle",
        6: "guided by hand",
        7: "running",
        8: "being jogged",
        9: "in alarm",
        10: "paused",
        11: "stopped by a collision",
    },
}
"""Meaning of RobotMode by firmware; 8 and 11 differ."""

FOLLOWING_MODES = (5, 7)
"""Modes in which servo points are followed: idle and running."""

_JOINT_NUMBERS = range(1, 7)
ALARM_TEXTS = {
    16: "a planned point is near the shoulder singularity",
    17: "no joint angles reach the pose",
    18: "outside the work area",
    19: "the points of an arc coincide",
    22: "wrong orientation of the arm",
    23: "the end of a line is out of reach",
    24: "the end of an arc is out of reach",
    26: "a planned point is near the wrist singularity",
    27: "a planned point is near the elbow singularity",
    28: "wrong motion command",
    29: "wrong speed",
    32: "moved near the shoulder singularity",
    33: "no joint angles reach the pose on the way",
    34: "left the work area on the way",
    35: "moved near the wrist singularity",
    36: "moved near the elbow singularity",
    37: "a joint would turn by more than 180 degrees",
    **{47 + k: f"joint {k} is too fast" for k in _JOINT_NUMBERS},
    **{62 + 2 * k: f"joint {k} is at its positive end" for k in _JOINT_NUMBERS},
    **{63 + 2 * k: f"joint {k} is at its negative end" for k in _JOINT_NUMBERS},
    116: "emergency stop",
    117: "collision",
    119: "contact with the skin",
    132: "software emergency stop",
    133: "the user's emergency stop",
    165: "emergency stop",
    194: "tracking limit",
    224: "a safety wall was crossed",
    **{241 + k: f"joint {k} follows too far behind" for k in _JOINT_NUMBERS},
    2050: "protective stop timed out",
    **{2068 + k: "a limit of the tool’s position, speed, force or plane" for k in range(1, 7)},
    **{50223 + k: "wrong arguments of a servo point" for k in range(1, 8)},
    -2: "collision",
    -3: "contact with the skin",
}
"""Meaning of alarm numbers."""


def alarm_text(number: int) -> str:
    """Return the number and meaning of an alarm."""
    return f"alarm {number}: {ALARM_TEXTS.get(number, 'see the vendor’s list')}"
