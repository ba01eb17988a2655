"""Rod of the paper as a chain of nodes."""

from __future__ import annotations

from dataclasses import dataclass

from lariat.paper.xpbd.properties import XpbdProperties
from lariat.rod.model import RodModel

DEFAULT_ITERATIONS = 20
"""Number J of sweeps over the constraints in a step, which the paper does not give."""


@dataclass(frozen=True)
class XpbdRodModel(RodModel[XpbdProperties]):
    """Chain of nodes that is stepped by Algorithm 1 of the paper."""

    iterations: int = DEFAULT_ITERATIONS
    """Number J of sweeps over the constraints in a step."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.iterations < 1:
            raise ValueError(
                f"iterations must be at least 1, got {self.iterations}; try {DEFAULT_ITERATIONS}"
            )
