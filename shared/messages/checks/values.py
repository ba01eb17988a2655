"""Checks of single values: lengths that fit, bounded numbers, places, rotations.

All raise a `ValueError` that names the field and its limit.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from google.protobuf.message import Message

Checks = Mapping[type[Message], Callable[[Any], None]]
"""Check of each type of message, which raises a `ValueError` that says what does not fit."""
MAX_INTEGER = 2**62
"""Largest magnitude of an integer; sums and differences of two stamps stay in 64 bits."""
MAX_NODES = 2000
"""Largest number of nodes of a rope."""
MAX_MAGNITUDE = 1e6
"""Magnitude above which a component of a vector is no length, speed or angle [SI]."""
MAX_COORDINATE = 100.0
"""Largest coordinate of a rope, goal or path [m]; the time and memory of a plan grow with it."""
MAX_TURNS = 1000.0
"""Largest twist of a goal or a rope [turns]."""
MAX_NORM_ERROR = 0.1
"""Largest deviation of a quaternion's norm from one [-]."""
SHORT_VECTOR = 32
"""Number of values from which an array is faster than a loop."""


def all_within(values: Sequence[float], bound: float) -> bool:
    """Whether no number is beyond ±bound, or none."""
    # A slice of a field is a list, whose numbers are read ten times as fast. A comparison with a
    # number that is none is false, and the largest of several is none if one of them is.
    if len(values) < SHORT_VECTOR:
        return all(-bound <= value <= bound for value in values[:])
    return bool(np.abs(np.asarray(values)).max() <= bound)


def check_length(name: str, values: Sequence[Any], *lengths: int) -> None:
    """Check that a field has one of some numbers of values."""
    if len(values) not in lengths:
        expected = " or ".join(map(str, lengths))
        raise ValueError(f"{name} has {len(values)} values; it takes {expected}")


def count_points(name: str, values: Sequence[float], width: int = 3) -> int:
    """Return the number of points of a flat field, `width` values each."""
    if len(values) % width:
        raise ValueError(f"{name} has {len(values)} values, not {width} a point")
    return len(values) // width


def count_nodes(name: str, values: Sequence[float]) -> int:
    """Return the number of nodes of a rope; 0 where it is not known."""
    count = count_points(name, values)
    if count == 1 or count > MAX_NODES:
        raise ValueError(f"{name} has {count} nodes; a rope has 2 to {MAX_NODES}")
    return count


def check_places(name: str, values: Sequence[float]) -> None:
    """Check that coordinates lie in a cell."""
    if not all_within(values, MAX_COORDINATE):
        raise ValueError(f"{name} holds a coordinate beyond ±{MAX_COORDINATE:g} m, or none")


def check_bounded(name: str, values: Sequence[float]) -> None:
    """Check that numbers may be lengths, speeds or angles."""
    if not all_within(values, MAX_MAGNITUDE):
        raise ValueError(f"{name} holds a number beyond ±{MAX_MAGNITUDE:g}, or none")


def check_integer(name: str, value: int) -> None:
    """Check that sums and differences of an integer stay in 64 bits."""
    if abs(value) > MAX_INTEGER:
        raise ValueError(f"{name} holds an integer beyond ±2^62")


def check_rotation(name: str, values: Sequence[float]) -> None:
    """Check a quaternion, if there is one."""
    if values and not abs(math.hypot(*values) - 1.0) <= MAX_NORM_ERROR:
        raise ValueError(f"{name} has norm {math.hypot(*values):g}; a rotation has norm 1")


def check_rotations(name: str, values: Sequence[float]) -> None:
    """Check the quaternions of a flat field."""
    norms = np.linalg.norm(np.reshape(values, (-1, 4)), axis=1)
    if not np.all(np.abs(norms - 1.0) <= MAX_NORM_ERROR):
        raise ValueError(f"{name} holds a quaternion that is no rotation; its norm must be 1")


def check_turns(turns: float) -> None:
    """Check the twist of a goal or a rope [turns]."""
    if not abs(turns) <= MAX_TURNS:
        raise ValueError(f"turns = {turns:g}, beyond ±{MAX_TURNS:g}")
