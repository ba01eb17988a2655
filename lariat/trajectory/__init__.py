"""Jerk-limited motion of grippers: states, limits, stops, and setpoint chunks as smooth curves."""

from lariat.trajectory.blend import Blend
from lariat.trajectory.chunk import NANOSECONDS, SECOND, SetpointChunk
from lariat.trajectory.limits import MotionLimits, clipped
from lariat.trajectory.sequence import MotionSequence
from lariat.trajectory.spline import Spline
from lariat.trajectory.state import MotionState, mean_twists
from lariat.trajectory.stop import Stop, peak_twists, stopping_states

__all__ = [
    "NANOSECONDS",
    "SECOND",
    "Blend",
    "MotionLimits",
    "MotionSequence",
    "MotionState",
    "SetpointChunk",
    "Spline",
    "Stop",
    "clipped",
    "mean_twists",
    "peak_twists",
    "stopping_states",
]
