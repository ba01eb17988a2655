"""Sequence of states of motion, as arrays over time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64

from lariat.trajectory.state import MotionState


@dataclass(frozen=True)
class MotionSequence:
    """Poses, twists and accelerations of k grippers at t moments, in the world frame."""

    positions: Float64[np.ndarray, "t k 3"]
    """Positions [m]."""
    orientations: Float64[np.ndarray, "t k 4"]
    """Unit quaternions, wxyz."""
    twists: Float64[np.ndarray, "t k 2 3"]
    """Linear and angular velocity [m/s, rad/s]."""
    accelerations: Float64[np.ndarray, "t k 2 3"]
    """Linear and angular acceleration [m/s^2, rad/s^2]."""

    @classmethod
    def constant(cls, state: MotionState, count: int) -> MotionSequence:
        """Return a sequence of one state, again and again."""
        return cls(*(np.repeat(part[None], count, axis=0) for part in _parts(state)))

    @classmethod
    def joined(cls, *sequences: MotionSequence) -> MotionSequence:
        """Return sequences one after the other."""
        return cls(*map(np.concatenate, zip(*map(_parts, sequences), strict=True)))

    def __len__(self) -> int:
        """Return the number of states."""
        return len(self.positions)

    def __getitem__(self, index: int) -> MotionState:
        """Return one state."""
        return MotionState(*(part[index] for part in _parts(self)))

    def between(self, first: int, end: int | None = None) -> MotionSequence:
        """Return the states from one index up to another, which is not among them."""
        return MotionSequence(*(part[first:end] for part in _parts(self)))

    @property
    def resting(self) -> bool:
        """Whether all twists and accelerations are exactly zero."""
        return not (self.twists.any() or self.accelerations.any())


def _parts(of: MotionState | MotionSequence) -> tuple[np.ndarray, ...]:
    return of.positions, of.orientations, of.twists, of.accelerations
