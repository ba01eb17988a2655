"""Cases with a known exact solution: errors of a rod over its number of nodes, and their bounds."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

ROUNDING_ERROR = 1e-9
"""Error below which rounding and the solver's tolerance hide the discretization [any unit]."""


@dataclass(frozen=True)
class Case:
    """Problem whose exact solution is known."""

    name: str
    unit: str
    """Unit of the error; L is the length of the rod, % a percentage of the exact value."""
    error: Callable[[int], float]
    """Error of a rod, by its number of nodes; of a shape, the mean over its nodes."""
    node_counts: tuple[int, ...]
    """Numbers of nodes to measure, ascending."""
    bounds: Mapping[int, float] = field(default_factory=dict)
    """Largest allowed error, by number of nodes."""
    min_order: float | None = None
    """Smallest allowed order of convergence; None where the error has no order."""

    def errors(self) -> list[float]:
        """Measure the error for each number of nodes."""
        return [self.error(n) for n in self.node_counts]

    def order(self, errors: Sequence[float]) -> float | None:
        """Order of convergence between the smallest and the largest number of nodes [-].

        None for one number of nodes, and for errors at the level of rounding.
        """
        if len(errors) < 2 or errors[-1] < ROUNDING_ERROR:
            return None
        coarse, *_, fine = self.node_counts
        return math.log(errors[0] / errors[-1]) / math.log((fine - 1) / (coarse - 1))

    def held(self, errors: Sequence[float]) -> bool:
        """Return whether errors and order are within their bounds."""
        by_count = dict(zip(self.node_counts, errors, strict=True))
        bounded = all(by_count[n] <= bound for n, bound in self.bounds.items())
        order = self.order(errors)
        return bounded and (self.min_order is None or (order or 0.0) >= self.min_order)
