"""State of a rod, and directions in which it can change."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float64

from lariat.rod.friction import ContactSlips


@dataclass(frozen=True)
class RodState:
    """Positions of n nodes and orientations of m frames along the rod, with velocities.

    The frames are those of the n - 1 edges, in order from left to right; a clamp adds the frame of
    its grip before the first or after the last one (`RodModel.frame_count`).
    """

    positions: Float64[np.ndarray, "n 3"]
    """Node positions, world frame [m]."""
    orientations: Float64[np.ndarray, "m 4"]
    """Orientations of the frames, unit quaternions wxyz, frame to world. The third axis lies along
    the rod, from left to right."""
    velocities: Float64[np.ndarray, "n 3"]
    """Node velocities, world frame [m/s]."""
    angular_velocities: Float64[np.ndarray, "m 3"]
    """Angular velocities of the frames, world frame [rad/s]."""
    contact: ContactSlips | None = None
    """Slips on bodies with friction; None for a rod that no friction pulls at."""
    plastic_curvature: Float64[np.ndarray, "m-1 l 3"] | None = None
    """Curvature about d1 and d2 and twist that each of the l layers (`RodProperties.layers`) of the
    bend between two frames keeps [1/m]; None for a rod that keeps none."""

    def at_rest(self) -> RodState:
        """Return the same shape without motion."""
        return replace(
            self,
            velocities=np.zeros_like(self.velocities),
            angular_velocities=np.zeros_like(self.angular_velocities),
        )


@dataclass(frozen=True)
class StateDirections:
    """D directions in the space of `RodState`, each of any scale."""

    positions: Float64[np.ndarray, "D n 3"]
    """Displacements of the nodes [m per unit]."""
    rotations: Float64[np.ndarray, "D m 3"]
    """Rotations of the frames about the world axes [rad per unit]."""
    velocities: Float64[np.ndarray, "D n 3"]
    """Changes of node velocities [m/s per unit]."""
    angular_velocities: Float64[np.ndarray, "D m 3"]
    """Changes of the frames' angular velocities [rad/s per unit]."""
    slips: Float64[np.ndarray, "D m e s 3"] | None = None
    """Changes of the slips on bodies with friction [m per unit]; None for none."""
    plastic_curvature: Float64[np.ndarray, "D m-1 l 3"] | None = None
    """Changes of what layers of the bends keep [1/m per unit]; None for none."""

    def check(self, node_count: int, frame_count: int) -> None:
        """Check shapes and values against the numbers of nodes and of frames of a rod.

        Raises:
            ValueError: A field does not fit the rod or is not finite.
        """
        for name in ("positions", "rotations", "velocities", "angular_velocities"):
            value = np.asarray(getattr(self, name))
            turning = name in ("rotations", "angular_velocities")
            rows = frame_count if turning else node_count
            if value.shape != (len(self.positions), rows, 3) or not np.all(np.isfinite(value)):
                raise ValueError(
                    f"state_directions.{name} must be finite and ({len(self.positions)}, {rows}, "
                    f"3), got shape {value.shape}; this rod has {node_count} nodes and "
                    f"{frame_count} frames"
                )
