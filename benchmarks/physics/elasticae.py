"""Ropes that hang between two ends, against the equilibrium of the continuum.

The base is a rope of 0.45 m and 8 mm whose ends are 0.24 m apart; each case changes some of it. The
error is the distance between nodes of the rod and points of the continuum at equal arc length.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np
from jaxtyping import Float64

from benchmarks.physics.continuum import Equilibrium, equilibrium
from benchmarks.physics.convergence import Case, Error
from lariat.geometry import poses
from lariat.geometry.poses import Pose
from lariat.rod import Rod, RodProperties, add_turns
from lariat.rod.model import End
from lariat.rod.results import Rest

NODE_COUNTS = (10, 20, 40, 80, 160, 320)
"""Numbers of nodes of the rods."""
REFERENCE_NODES = 160
"""Number of nodes of the rod from which the continuum's solver starts."""
SOLVER_TOLERANCE = 1e-9
"""Tolerance of the rods [m]."""
MAX_MEAN_ERROR = 0.3
"""Largest allowed mean error at n = 40 [mm]."""
MIN_ORDER = 1.8
"""Smallest allowed order of convergence [-]."""
ROPE = RodProperties(length=0.45, diameter=0.008, linear_density=0.044, youngs_modulus=1e6)
"""Rope of most cases."""
ALONG_X = poses.rotation_between(np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0]))
"""Orientation of a grip that holds the rod along x."""


def level_grip(x: float, z: float = 0.0, *, yaw: float = 0.0, pitch: float = 0.0) -> Pose:
    """Return a grip along x that is pitched up, then yawed.

    Args:
        x: Position along x [m].
        z: Height [m].
        yaw: Rotation about the vertical [degrees].
        pitch: Elevation of the rod's direction, which points from left to right [degrees].
    """
    elevate = poses.exponential(math.radians(pitch) * np.array([0.0, -1.0, 0.0]))
    turn = poses.exponential(math.radians(yaw) * np.array([0.0, 0.0, 1.0]))
    return Pose(np.array([x, 0.0, z]), poses.multiply(turn, poses.multiply(elevate, ALONG_X)))


@dataclass(frozen=True)
class HeldRope:
    """Rope with held ends, at rest."""

    properties: RodProperties = ROPE
    """Material and dimensions."""
    left: Pose = level_grip(-0.12)
    """Left grip."""
    right: Pose = level_grip(0.12)
    """Right grip."""
    left_end: End = "clamped"
    """Hold of the left end."""
    right_end: End = "clamped"
    """Hold of the right end."""
    twist: float = 0.0
    """Rotation of the right grip about the rod's axis, of any number of turns [rad]."""

    @property
    def grips(self) -> tuple[Pose, Pose]:
        """Both grips, the right one with its twist."""
        spin = poses.exponential(self.twist * np.array([0.0, 0.0, 1.0]))
        return self.left, Pose(self.right.position, poses.multiply(self.right.orientation, spin))

    @cached_property
    def continuum(self) -> Equilibrium:
        """Equilibrium of the continuum."""
        return equilibrium(self.rod(REFERENCE_NODES), *self.grips, self.rest(REFERENCE_NODES).state)

    def rod(self, node_count: int) -> Rod:
        """Return the rod with some number of nodes."""
        return Rod(
            self.properties,
            node_count,
            self.left_end,
            self.right_end,
            tolerance=SOLVER_TOLERANCE,
        )

    def rest(self, node_count: int) -> Rest:
        """Return the rest shape of the rod with some number of nodes."""
        rod = self.rod(node_count)
        rest = rod.rest(*self.grips)
        turns = round(self.twist / (2.0 * np.pi))
        if turns:
            rest = rod.rest(*self.grips, guess=add_turns(rest.state, turns))
        return rest

    def distances(self, node_count: int) -> Float64[np.ndarray, "n"]:
        """Return the distance of every node from the continuum at equal arc length [m]."""
        exact = self.continuum.positions(node_count)
        return np.linalg.norm(self.rest(node_count).state.positions - exact, axis=1)


def error(rope: HeldRope, node_count: int) -> Error:
    """Return mean and largest distance of the nodes from the continuum [mm]."""
    distances = 1e3 * rope.distances(node_count)
    return Error(float(distances.mean()), float(distances.max()))


def _stiffer(factor: float, **changes: object) -> HeldRope:
    return HeldRope(replace(ROPE, youngs_modulus=factor * ROPE.youngs_modulus, **changes))


def _apart(distance: float, rope: HeldRope | None = None) -> HeldRope:
    return replace(
        rope or HeldRope(), left=level_grip(-distance / 2.0), right=level_grip(distance / 2.0)
    )


CLAMPED_ROPES: dict[str, HeldRope] = {
    "0.24 m apart": HeldRope(),
    "E / 4": _stiffer(0.25),
    "E x 4": _stiffer(4.0),
    "0.12 m apart": _apart(0.12),
    "0.12 m apart, E / 4": _apart(0.12, _stiffer(0.25)),
    "0.36 m apart": _apart(0.36),
    "0.42 m apart": _apart(0.42),
    "right end 0.1 m higher": replace(HeldRope(), right=level_grip(0.08, 0.1)),
    "pitched": replace(
        HeldRope(), left=level_grip(-0.12, pitch=-40.0), right=level_grip(0.12, pitch=50.0)
    ),
    "yawed": replace(
        HeldRope(), left=level_grip(-0.12, yaw=35.0), right=level_grip(0.12, yaw=-60.0)
    ),
    "yawed and pitched, E / 4": replace(
        _stiffer(0.25),
        left=level_grip(-0.12, yaw=40.0, pitch=-30.0),
        right=level_grip(0.12, 0.05, yaw=25.0, pitch=20.0),
    ),
    "twisted by 2.5 rad": replace(HeldRope(), twist=2.5),
    "yawed, one turn, E x 4": replace(
        _stiffer(4.0),
        left=level_grip(-0.12, yaw=20.0),
        right=level_grip(0.12, yaw=30.0),
        twist=2.0 * math.pi,
    ),
    "naturally curved": _stiffer(1.0, rest_curvature=((4.0, 0.0, 3.0),)),
    "tapered": _stiffer(1.0, stiffness_profile=(0.5, 2.0), density_profile=(1.4, 0.6)),
}
"""Ropes between two clamps, by name."""
OTHER_ROPES: dict[str, HeldRope] = {
    "cantilever, E x 8": replace(_stiffer(8.0), right_end="free"),
    "cantilever, E x 2": replace(_stiffer(2.0), right_end="free"),
    "clamped and pinned": replace(HeldRope(), right_end="pinned"),
    "pinned at both ends": replace(HeldRope(), left_end="pinned", right_end="pinned"),
}
"""Ropes with a free or a pinned end, by name."""
CASES: tuple[Case, ...] = tuple(
    Case(name, "mm", partial(error, rope), NODE_COUNTS, {40: MAX_MEAN_ERROR}, MIN_ORDER)
    for name, rope in (CLAMPED_ROPES | OTHER_ROPES).items()
)
"""Cases of the convergence table."""
