"""Pairing of the ends of fragments at crossings, by the least total bending over all pairings.

The bending of a pair is the energy of the cubic between two places with directions,
integral of the squared curvature, relative to its length: a circular arc costs a third of an S of
the same turning. An end that finds no partner costs as much as a sharp bend.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable

import numpy as np

from lariat.perception.lines.fragments import EndPose, Fragment, FragmentEnd

FREE_END_COST = 0.7
"""Cost of an end that finds no partner [-]: the bending above which a rope rather ends."""
SHORTEST_WIDTHS = 4.0
"""Length below which the bending does not grow further [rope widths]."""
COLOR_SIGMA = 25.0
"""Difference of colours that costs one [Lab]."""
LIGHTNESS_WEIGHT = 0.5
"""Weight of lightness in that difference [-]: it changes with the light along a rope."""
MAX_EXACT_ENDS = 8
"""Number of ends up to which all pairings are compared; beyond, pairs are chosen greedily."""

EndCost = Callable[[FragmentEnd, FragmentEnd], float]
"""Cost of a pair of ends."""
Pairs = tuple[tuple[FragmentEnd, FragmentEnd], ...]
"""Pairs of ends."""


def bending(one: EndPose, two: EndPose, width: float) -> float:
    """Return the bending of a rope that leaves by one end and continues at another [-].

    Args:
        one: End that is left.
        two: End that is entered, against its outward direction.
        width: Width of the ropes [pixels].
    """
    chord = two.position - one.position
    length = float(np.linalg.norm(chord))
    if length < 1e-9 or not (np.any(one.outward) and np.any(two.outward)):
        return FREE_END_COST
    first = _signed_angle(chord, one.outward)
    second = _signed_angle(chord, -two.outward)
    # Energy of a cubic whose slopes against its chord are these two.
    energy = 4.0 * (first**2 + first * second + second**2) / max(length / width, SHORTEST_WIDTHS)
    return energy if max(abs(first), abs(second)) < np.pi / 1.8 else energy + FREE_END_COST


def color_cost(one: Fragment, two: Fragment) -> float:
    """Return the cost of a pair of different colours [-]."""
    difference = (one.color - two.color) * np.array([LIGHTNESS_WEIGHT, 1.0, 1.0])
    return float(difference @ difference) / COLOR_SIGMA**2


def cheapest_pairing(ends: Iterable[FragmentEnd], cost: EndCost) -> tuple[float, float, Pairs]:
    """Return the cost of the cheapest pairing, that of the next one, and the pairs.

    Args:
        ends: Ends, each in one pair at most.
        cost: Cost of a pair; one above twice `FREE_END_COST` is never chosen.
    """
    ends = sorted(ends)
    costs = {pair: cost(*pair) for pair in itertools.combinations(ends, 2)}
    costs = {pair: c for pair, c in costs.items() if c < 2.0 * FREE_END_COST}
    if len(ends) > MAX_EXACT_ENDS:
        return _greedy(ends, costs)
    ranked = sorted(_all_pairings(ends, costs), key=lambda p: p[0])
    best, pairs = ranked[0]
    return best, ranked[1][0] if len(ranked) > 1 else np.inf, pairs


def _all_pairings(
    ends: list[FragmentEnd], costs: dict[tuple[FragmentEnd, FragmentEnd], float]
) -> list[tuple[float, Pairs]]:
    """Cost and pairs of every pairing."""
    if not ends:
        return [(0.0, ())]
    first, rest = ends[0], ends[1:]
    pairings = [(FREE_END_COST + c, p) for c, p in _all_pairings(rest, costs)]
    for partner in rest:
        pair = costs.get((first, partner))
        if pair is not None:
            others = [e for e in rest if e != partner]
            pairings += [
                (pair + c, ((first, partner), *p)) for c, p in _all_pairings(others, costs)
            ]
    return pairings


def _greedy(
    ends: list[FragmentEnd], costs: dict[tuple[FragmentEnd, FragmentEnd], float]
) -> tuple[float, float, Pairs]:
    free = set(ends)
    chosen: list[tuple[FragmentEnd, FragmentEnd]] = []
    total = 0.0
    for pair in sorted(costs, key=lambda p: costs[p]):
        if free.issuperset(pair):
            free -= set(pair)
            chosen.append(pair)
            total += costs[pair]
    total += FREE_END_COST * len(free)
    # Nobody has compared the pairings: the next one may cost as little.
    return total, total, tuple(chosen)


def _signed_angle(one: np.ndarray, two: np.ndarray) -> float:
    """Angle from one vector of the plane to another [rad]."""
    return float(np.arctan2(one[0] * two[1] - one[1] * two[0], one @ two))
