"""Errors of a rod over its number of nodes, with observed orders of convergence."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

ROUNDING_ERROR = 1e-9
"""Error below which rounding and the solver's tolerance hide the discretization [any unit]."""


class Error(NamedTuple):
    """Error of a rod with some number of nodes."""

    value: float
    """Error that is bounded; of a shape, the mean over its nodes."""
    largest: float | None = None
    """Largest error of a node, of a shape."""


@dataclass(frozen=True)
class Case:
    """Problem whose exact solution is known."""

    name: str
    """Name in the tables."""
    unit: str
    """Unit of the error; L is the length of the rod, % a percentage of the exact value."""
    error: Callable[[int], Error]
    """Error of a rod, by its number of nodes."""
    node_counts: tuple[int, ...]
    """Numbers of nodes to measure, ascending."""
    bounds: Mapping[int, float] = field(default_factory=dict)
    """Largest allowed error, by number of nodes."""
    min_order: float | None = None
    """Smallest allowed order of convergence; None where the error has no order."""


@dataclass(frozen=True)
class Convergence:
    """Errors of one case over its numbers of nodes."""

    case: Case
    """The case."""
    errors: tuple[Error, ...]
    """Error for each number of nodes."""

    @property
    def order(self) -> float | None:
        """Order of convergence between the smallest and the largest number of nodes [-].

        None for one number of nodes, and for errors at the level of rounding.
        """
        first, last = self.errors[0].value, self.errors[-1].value
        if len(self.errors) < 2 or last < ROUNDING_ERROR:
            return None
        counts = self.case.node_counts
        return math.log(first / last) / math.log((counts[-1] - 1) / (counts[0] - 1))

    @property
    def held(self) -> bool:
        """Whether errors and order are within their bounds."""
        errors = dict(zip(self.case.node_counts, self.errors, strict=True))
        bounded = all(errors[n].value <= bound for n, bound in self.case.bounds.items())
        if self.case.min_order is None:
            return bounded
        return bounded and self.order is not None and self.order >= self.case.min_order


def measure(case: Case, report: Callable[[int], None] = lambda node_count: None) -> Convergence:
    """Measure the errors of a case."""
    errors = []
    for node_count in case.node_counts:
        report(node_count)
        errors.append(case.error(node_count))
    return Convergence(case, tuple(errors))
