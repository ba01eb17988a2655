"""Checks of messages about the rope: where it is seen, others beside it, and what it is made of."""

from __future__ import annotations

from lariat.rope_parameters import PUBLISHED, Values
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
from shared.messages.parameters import rod_estimates

MAX_OTHER_ROPES, MAX_LINES = 32, 64
"""Largest number of ropes beside the held one, and of lines of each."""
MAX_DIAMETER = 1.0
"""Largest diameter of a rope [m]."""
MAX_KNOTS = 256
"""Largest number of knots of a profile along the rope."""
GRIP_ERROR_COUNT = 6
"""Number of components of an error of both grips."""
MAX_COUNTS = {
    Values.SCALAR: 1,
    Values.FACTORS: MAX_KNOTS,
    Values.CURVATURE: 3 * MAX_KNOTS,
    Values.GRIPS: GRIP_ERROR_COUNT,
}
"""Largest number of estimates of a parameter."""


def _check_node_chain(message: messages.NodeChain) -> None:
    check_integer("stamp", message.stamp)
    count = count_nodes("positions", message.positions)
    check_places("positions", message.positions)
    check_bounded("sigma", message.sigma)
    check_length("sigma", message.sigma, 0, count)
    check_length("observed", message.observed, 0, count)
    if not 0.0 <= message.p_wrong <= 1.0:
        raise ValueError(f"p_wrong = {message.p_wrong:g} is no probability")


def _check_other_ropes(message: messages.OtherRopes) -> None:
    if len(message.ropes) > MAX_OTHER_ROPES:
        raise ValueError(f"{len(message.ropes)} other ropes, more than {MAX_OTHER_ROPES}")
    for rope in message.ropes:
        if not 0.0 < rope.diameter <= MAX_DIAMETER:
            raise ValueError(f"diameter = {rope.diameter:g} m is not within 0…{MAX_DIAMETER:g} m")
        if not 0.0 <= rope.p_wrong <= 1.0:
            raise ValueError(f"p_wrong = {rope.p_wrong:g} is no probability")
        if len(rope.lines) > MAX_LINES:
            raise ValueError(f"{len(rope.lines)} lines, more than {MAX_LINES}")
        for line in rope.lines:
            count_nodes("positions", line.positions)
            check_places("positions", line.positions)


def _check_parameters(message: messages.Parameters) -> None:
    if message.plastic_curvature:
        count_points("plastic_curvature", message.plastic_curvature)
    count = len(message.unknowns)
    check_length("covariance", message.covariance, count * (count + 1) // 2)
    rod = message.rod
    for parameter in PUBLISHED:
        name, estimates = f"rod.{parameter.name}", rod_estimates(rod, parameter)
        if len(estimates) > MAX_COUNTS[parameter.values]:
            raise ValueError(
                f"{name} has {len(estimates)} values, more than {MAX_COUNTS[parameter.values]}"
            )
        for estimate in estimates:
            _check_estimate(name, estimate, *parameter.bounds)
        if parameter.values is Values.CURVATURE:
            count_points(name, estimates)
        if parameter.values is Values.GRIPS and estimates:
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
