"""Motions of both grips from one pair of poses to another, for many pairs at once.

The middle of the grips moves in a straight line while the line between them turns and changes its
length, so that the grips neither meet nor overstretch the rope on the way. A fixed grip takes the
place of the middle.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float64

from lariat.geometry import poses
from lariat.geometry.grips import Grips


@dataclass(frozen=True)
class Chords:
    """Lines between both grips, without the orientations of the grips."""

    middles: Float64[np.ndarray, "*b 3"]
    """Middles of the grips, without effect where one is fixed [m]."""
    chords: Float64[np.ndarray, "*b 3"]
    """Vectors from the left to the right grip [m]."""

    def __len__(self) -> int:
        return len(self.middles)

    def __getitem__(self, index: object) -> Chords:
        return Chords(self.middles[index], self.chords[index])


@dataclass(frozen=True)
class GripMotion:
    """Motions and their lengths, for a rope and the freedom of its ends."""

    moves: Bool[np.ndarray, "2 6"]
    """Mask of the free components of each grip's velocity: translation, then rotation."""
    lever: float
    """Lever arm that converts a rotation into a displacement [m]."""

    def length(self, a: Grips, b: Grips, turning: bool = True) -> Float64[np.ndarray, "*k"]:
        """Return upper bounds on how far a grip moves from `a` to `b`, rotation included [m].

        Args:
            a: First places; broadcast against the others.
            turning: Whether rotations of the grips count.
        """
        (base_a, chord_a), (base_b, chord_b) = self._parts(a.positions), self._parts(b.positions)
        far_a, far_b = np.linalg.norm(chord_a, axis=-1), np.linalg.norm(chord_b, axis=-1)
        cosine = np.sum(chord_a * chord_b, axis=-1) / np.maximum(far_a * far_b, 1e-12)
        angle = np.arccos(np.clip(cosine, -1.0, 1.0))
        share = 0.5 if self.moves[:, :3].all() else 1.0
        bound = np.linalg.norm(base_b - base_a, axis=-1)
        bound = bound + share * (angle * np.maximum(far_a, far_b) + np.abs(far_b - far_a))
        if turning and self.moves[:, 3:].any():
            cosines = np.abs(np.sum(a.orientations * b.orientations, axis=-1))
            turned = 2.0 * np.arccos(np.clip(cosines, 0.0, 1.0))
            bound = bound + self.lever * np.max(turned, axis=-1)
        return bound

    def between(self, a: Grips, b: Grips, shares: Float64[np.ndarray, "k h"]) -> Grips:
        """Return the places at shares of the motions from `a` to `b`, (k h) of them.

        Args:
            shares: Shares of each motion [-].
        """
        (base_a, chord_a), (base_b, chord_b) = self._parts(a.positions), self._parts(b.positions)
        far_a = np.linalg.norm(chord_a, axis=-1)[:, None, None]
        far_b = np.linalg.norm(chord_b, axis=-1)[:, None, None]
        first = chord_a / np.maximum(np.linalg.norm(chord_a, axis=-1, keepdims=True), 1e-12)
        last = chord_b / np.maximum(np.linalg.norm(chord_b, axis=-1, keepdims=True), 1e-12)
        s = shares[..., None]
        turn = poses.logarithm(poses.rotation_between(first, last))[:, None]
        direction = poses.rotate(
            poses.exponential(s * turn), np.broadcast_to(first[:, None], (*shares.shape, 3))
        )
        chord = direction * ((1.0 - s) * far_a + s * far_b)
        base = base_a[:, None] + s * (base_b - base_a)[:, None]
        positions = self._places(base, chord)
        positions[shares >= 1.0] = np.repeat(b.positions[:, None], shares.shape[1], axis=1)[
            shares >= 1.0
        ]
        whole = poses.rotation_from(a.orientations, b.orientations)
        steps = poses.exponential(s[..., None] * whole[:, None])
        turned = poses.multiply(steps, np.broadcast_to(a.orientations[:, None], steps.shape))
        return Grips(positions.reshape(-1, 2, 3), turned.reshape(-1, 2, 4))

    def placed(self, lines: Chords, like: Grips) -> Grips:
        """Return grips at k places, which rotate with the line between them as far as they can.

        Args:
            like: Grips that hold the rope as wanted, relative to the line between them.
        """
        base, chord = lines.middles, lines.chords
        here, line = self._parts(like.positions)
        if not self.moves[:, :3].all():
            base = here
        turn = poses.rotation_between(poses.normalized(line), poses.normalized(chord))
        turned = poses.multiply(np.repeat(turn[:, None], 2, axis=1), like.orientations)
        rotates = self.moves[:, 3:].any(axis=1)
        orientations = np.where(rotates[None, :, None], turned, like.orientations)
        return Grips(self._places(base, chord), orientations)

    def _parts(
        self, positions: Float64[np.ndarray, "*k 2 3"]
    ) -> tuple[Float64[np.ndarray, "*k 3"], Float64[np.ndarray, "*k 3"]]:
        """Base of a motion, and the line between the grips [m]."""
        left, right = positions[..., 0, :], positions[..., 1, :]
        free = self.moves[:, :3].any(axis=1)
        base = 0.5 * (left + right) if free.all() else right if free[0] else left
        return base, right - left

    def _places(
        self, base: Float64[np.ndarray, "*k 3"], chord: Float64[np.ndarray, "*k 3"]
    ) -> Float64[np.ndarray, "*k 2 3"]:
        """Positions of both grips [m]."""
        free = self.moves[:, :3].any(axis=1)
        if free.all():
            return np.stack([base - 0.5 * chord, base + 0.5 * chord], axis=-2)
        if free[0]:
            return np.stack([base - chord, base], axis=-2)
        return np.stack([base, base + chord], axis=-2)
