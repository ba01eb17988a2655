"""Spacing constraint: the two ends keep their distance from each other (rule `spacing`).

It holds for the grips themselves and for all bodies of the ends: grippers, links and bases.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float64

from lariat.machine_code.call import PreparedCall
from lariat.safety.constraints.gripper_kernel import LEAST_ROOM
from lariat.safety.constraints.sphere_distance import Spheres, sphere_distances
from lariat.safety.constraints.sphere_kernels import SphereKernels, finite


def grip_distances(positions: Float64[np.ndarray, "m 2 3"]) -> Float64[np.ndarray, "m"]:
    """Return the distance between both grips at m poses [m]."""
    return np.linalg.norm(positions[:, 1] - positions[:, 0], axis=1)


def body_spacing_slack(left: Spheres, right: Spheres, keep_out: float) -> Float64[np.ndarray, "m"]:
    """Return the slack of the distance between the bodies of both ends at m poses [m].

    Args:
        left: Spheres that cover the left end.
        right: Spheres that cover the right end.
        keep_out: Least distance between their surfaces [m].
    """
    return sphere_distances(left, right) - keep_out


class Bodies:
    """Spheres that cover one end along a path, in memory that stays."""

    def __init__(self) -> None:
        self.centres = np.zeros((0, 0, 3))
        """Centres in the world, for as many poses as there is room [m]."""
        self.radii = np.zeros(0)
        """Radii [m]."""

    def place(self, parts: Sequence[Spheres], count: int) -> None:
        """Take the spheres of gripper, links and base at m poses, or at one for all of these.

        Args:
            parts: Spheres of each body.
            count: Number of poses.
        """
        size = sum(len(part.radii) for part in parts)
        if count > len(self.centres) or size != len(self.radii):
            self.centres = np.zeros((max(2 * count, LEAST_ROOM), size, 3))
            self.radii = np.zeros(size)
        first = 0
        for part in parts:
            end = first + len(part.radii)
            self.centres[:count, first:end], self.radii[first:end] = part.centres, part.radii
            first = end


class BodySpacing:
    """Distance between the bodies of two ends."""

    def __init__(self, keep_out: float) -> None:
        """Create the distance of ends without bodies.

        Args:
            keep_out: Least distance between their surfaces [m].
        """
        self._keep_out = keep_out
        self._ends = Bodies(), Bodies()
        self._distances = np.zeros(0)
        self._call: PreparedCall | None = None
        self._called: list[np.ndarray] = []
        """Centres for which the call is prepared."""

    def slack(
        self,
        left: Sequence[Spheres],
        right: Sequence[Spheres],
        count: int,
        kernels: SphereKernels | None,
    ) -> Float64[np.ndarray, "m"]:
        """Return the slack of the distance at m poses [m]; the next one overwrites it.

        Args:
            left: Spheres of the bodies of the left end, at m poses or at one for all of these.
            right: Spheres of the right end.
            count: Number of poses.
            kernels: Compiled distances; None: those of NumPy.
        """
        for end, parts in zip(self._ends, (left, right), strict=True):
            end.place(parts, count)
        a, b = (end.centres[:count] for end in self._ends)
        if kernels is None or not (finite(a) and finite(b)):
            spheres = (Spheres(end.centres[:count], end.radii) for end in self._ends)
            return body_spacing_slack(*spheres, self._keep_out)
        self._prepared(kernels)(count)
        return self._distances[:count] - self._keep_out

    def _prepared(self, kernels: SphereKernels) -> PreparedCall:
        """Return the call for the present bodies."""
        left, right = self._ends
        if self._call is None or any(
            a is not b for a, b in zip(self._called, (left.centres, right.centres), strict=True)
        ):
            self._called = [left.centres, right.centres]
            self._distances = np.zeros(min(map(len, self._called)))
            self._call = kernels.least_distances.prepared(
                left.centres.reshape(-1, 3),
                left.radii,
                right.centres.reshape(-1, 3),
                right.radii,
                self._distances,
            )
        return self._call
