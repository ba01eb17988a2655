"""Checks of messages about the rope: where it is seen, others beside it, and what it is made of."""

from __future__ import annotations

from shared import messages
from shared.messages.checks.values import (
    MAX_MAGNITUDE,
    Checks,
    check_bounded,
    check_integer,
    check_length,
    check_places,
    count_nodes,
    count_points,
)

MAX_OTHER_ROPES, MAX_LINES = 32, 64
"""Largest number of ropes beside the held one, and of lines of each."""
MAX_DIAMETER = 1.0
"""Largest diameter of a rope [m]."""
MAX_KNOTS = 256
"""Largest number of knots of a profile along the rope."""
MAX_CURVATURE = 1e4
"""Largest component of a rest curvature [1/m]."""
GRIP_ERROR_COUNT = 6
"""Number of components of an error of both grips."""
MAX_GRIP_OFFSET, MAX_GRIP_ROTATION = 0.1, 3.2
"""Largest component of the error of a grip [m, rad]."""
MATERIAL_BOUNDS = {
    "bending_stiffness": (1e-9, 1e6),
    "twist_ratio": (1e-3, 1e3),
    "damping": (0.0, 1e6),
    "length": (1e-3, 1e3),
}
"""Least and largest estimate of a rope's parameter [SI]."""


def _check_node_chain(message: messages.NodeChain) -> None:
    check_integer("stamp", message.stamp)
    count = count_nodes("positions", message.positions)
    check_places("positions", message.positions)
    check_bounded("sigma", message.sigma)
    check_length("sigma", message.sigma, 0, count)
    check_length("observed", message.observed, 0, count)
    if not 0.0 <= message.doubt <= 1.0:
        raise ValueError(f"doubt = {message.doubt:g} is no probability")


def _check_other_ropes(message: messages.OtherRopes) -> None:
    if len(message.ropes) > MAX_OTHER_ROPES:
        raise ValueError(f"{len(message.ropes)} other ropes, more than {MAX_OTHER_ROPES}")
    for rope in message.ropes:
        if not 0.0 < rope.diameter <= MAX_DIAMETER:
            raise ValueError(f"diameter = {rope.diameter:g} m is not within 0…{MAX_DIAMETER:g} m")
        if not 0.0 <= rope.doubt <= 1.0:
            raise ValueError(f"doubt = {rope.doubt:g} is no probability")
        if len(rope.lines) > MAX_LINES:
            raise ValueError(f"{len(rope.lines)} lines, more than {MAX_LINES}")
        for line in rope.lines:
            count_nodes("positions", line.positions)
            check_places("positions", line.positions)


def _check_parameters(message: messages.Parameters) -> None:
    rod = message.rod
    for name, (low, high) in MATERIAL_BOUNDS.items():
        if rod.HasField(name):
            _check_estimate(f"rod.{name}", getattr(rod, name), low, high)
    profiles = (
        ("rod.stiffness_profile", rod.stiffness_profile, MAX_KNOTS, 1e-6, 1e6),
        ("rod.rest_curvature", rod.rest_curvature, 3 * MAX_KNOTS, -MAX_CURVATURE, MAX_CURVATURE),
        ("rod.grip_offset", rod.grip_offset, GRIP_ERROR_COUNT, -MAX_GRIP_OFFSET, MAX_GRIP_OFFSET),
        (
            "rod.grip_rotation",
            rod.grip_rotation,
            GRIP_ERROR_COUNT,
            -MAX_GRIP_ROTATION,
            MAX_GRIP_ROTATION,
        ),
    )
    for name, estimates, max_count, low, high in profiles:
        if len(estimates) > max_count:
            raise ValueError(f"{name} has {len(estimates)} values, more than {max_count}")
        for estimate in estimates:
            _check_estimate(name, estimate, low, high)
    count_points("rod.rest_curvature", rod.rest_curvature)
    for name, estimates in (
        ("rod.grip_offset", rod.grip_offset),
        ("rod.grip_rotation", rod.grip_rotation),
    ):
        if estimates:
            check_length(name, estimates, GRIP_ERROR_COUNT)


def _check_estimate(name: str, estimate: messages.Estimate, low: float, high: float) -> None:
    if not low <= estimate.value <= high:
        raise ValueError(f"{name} = {estimate.value:g} is not within {low:g}…{high:g}")
    if not 0.0 <= estimate.standard_deviation <= MAX_MAGNITUDE:
        raise ValueError(f"{name} has the standard deviation {estimate.standard_deviation:g}")


CHECKS: Checks = {
    messages.NodeChain: _check_node_chain,
    messages.OtherRopes: _check_other_ropes,
    messages.Parameters: _check_parameters,
}
"""Check of each type of message."""
