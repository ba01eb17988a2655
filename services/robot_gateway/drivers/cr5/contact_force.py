"""What an arm feels at its gripper beyond what it felt at rest, when a person armed it.

An arm without a force sensor infers the force from its motors' currents: its zero is off by its own
weight and friction, so only the change since that rest counts, and a short mean of it.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float64

REST_TIME = 0.4
"""Over which the force at rest is averaged [s]."""
SETTLING = 0.1
"""Time constant of the mean [s]."""


class Pull:
    """The change of a force."""

    def __init__(self) -> None:
        self._rows: list[Float64[np.ndarray, "3"]] = []
        self._at_rest: Float64[np.ndarray, "3"] | None = None
        self._mean = np.zeros(3)
        self._begun: int | None = None
        self._last = 0

    def begin(self) -> None:
        """Forgets the force at rest; it is averaged anew from the next one on."""
        self._rows, self._at_rest, self._begun = [], None, None

    @property
    def calibrated(self) -> bool:
        """Whether the force at rest is known."""
        return self._at_rest is not None

    def take(self, force: Float64[np.ndarray, "3"], now: int) -> None:
        """A new measurement [N] at `now` [ns]."""
        if self._at_rest is None:
            self._begun = now if self._begun is None else self._begun
            self._rows.append(force)
            if now - self._begun >= REST_TIME * 1e9:
                self._at_rest, self._mean = np.mean(self._rows, axis=0), np.zeros(3)
                self._rows = []
        else:
            share = 1.0 - np.exp(-1e-9 * (now - self._last) / SETTLING)
            self._mean = self._mean + share * (force - self._at_rest - self._mean)
        self._last = now

    @property
    def size(self) -> float:
        """Of the change [N]; 0 while the force at rest is not known."""
        return float(np.linalg.norm(self._mean)) if self.calibrated else 0.0
