"""Names of the rules that setpoints and motion must keep."""

from __future__ import annotations

from typing import Literal

Rule = Literal[
    "finite",
    "ordered",
    "fresh",
    "rest",
    "workspace",
    "keep_in",
    "keep_out",
    "table",
    "joint_limits",
    "joint_speed",
    "joint_acceleration",
    "singularity",
    "speed",
    "acceleration",
    "jerk",
    "step",
    "spacing",
    "overstretch",
    "lost_link",
]
"""Names that refusals, logs, `docs/concepts/safety.md` and tests use."""
