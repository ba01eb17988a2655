"""Constants that planner, controller and gateway share, so that no planned motion is refused.

The gateway enforces exactly the limits of the scenario. The planner and the controller use less: a
share of each limit on motion, a fraction of the rope's permitted stretch, and a margin from each
boundary. `lariat.geometry.grippers` holds the clearances between the bodies of the grippers.
"""

from __future__ import annotations

SETPOINT_PERIOD = 20_000_000
"""Time between two setpoints and between two points of a path [ns]."""
LEAST_CHUNK_SPAN = 0.25
"""Least time from the first setpoint of a chunk to its last that the gateway accepts [s]."""
CHUNK_SPAN = 0.26
"""Least time from the first setpoint of a chunk to its last that the controller sends [s]."""

PATH_LIMIT_SHARE = 0.7
"""Share of each limit on motion that a planned path uses [-]."""
OFFSET_LIMIT_SHARE = 0.28
"""Share of each limit for the offset that the controller adds to a path [-]. Path and offset
together stay below the limits."""
PATHLESS_LIMIT_SHARE = 0.85
"""Share of each limit for the offset when no path is planned [-]."""
STOP_LIMIT_SHARE = 0.9
"""Share of each limit for the stop at the end of a chunk [-]."""

PATH_STRETCH_SHARE = 0.985
"""Fraction of the permitted distance between the grips that a path uses [-], unless start or goal
need more (`longest_grip_distance`)."""
CONTROL_STRETCH_SHARE = 0.99
"""Fraction of the permitted distance between the grips that the controller uses [-], unless the
goal needs more."""
STRETCH_MARGIN = 5e-4
"""Margin below the longest distance between the grips that the gateway accepts in a chunk [m]."""
PATH_WORKSPACE_MARGIN = 0.003
"""Distance that a path keeps from the faces of the workspace [m]."""
PATH_SPACING_MARGIN = 0.005
"""Margin above the least distance between the grips that a path is optimised for [m]."""
CHUNK_BOUNDARY_MARGIN = 0.0015
"""Margin from every boundary that the gateway requires of a chunk, so that following it touches
none; the planner requires it of the distance between the grips [m]."""


def longest_grip_distance(share: float, permitted: float, needed: float) -> float:
    """Return the distance of the grips up to which a motion goes [m].

    A share of the permitted distance, or what a taut shape needs where that is more, as far as the
    gateway accepts it.

    Args:
        share: Share of the permitted distance that is used without need [-].
        permitted: Permitted distance, round obstacles too [m].
        needed: Distance at the goal, or at the start [m].
    """
    return min(permitted - CHUNK_BOUNDARY_MARGIN - STRETCH_MARGIN, max(share * permitted, needed))
