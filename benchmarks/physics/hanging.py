"""Ropes that hang between two ends, against the equilibrium of the continuum.

The base is a rope of 0.45 m and 8 mm whose ends are 0.24 m apart; each case changes some of it. The
error is the mean distance of nodes from points of the continuum at equal arc length.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from jaxtyping import Float64

from benchmarks.physics.cases import Case
from benchmarks.physics.continuum import Equilibrium, equilibrium
from lariat.geometry import poses
from lariat.geometry.poses import Pose
from lariat.rod import Rod, RodProperties, add_turns
from lariat.rod.model import End
from lariat.rod.results import Rest

MAX_MEAN_ERROR, MIN_ORDER = 0.3, 1.8
"""Largest allowed mean error at n = 40 [mm], and smallest allowed order of convergence [-]."""
REFERENCE_NODES = 160
"""Number of nodes of the rod from which the continuum's solver starts."""
ROPE = RodProperties(length=0.45, diameter=0.008, linear_density=0.044, youngs_modulus=1e6)
"""Rope of most cases."""
ALONG_X = poses.rotation_between(np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0]))
"""Orientation of a grip that holds the rod along x."""


def level_grip(x: float, z: float = 0.0, *, yaw: float = 0.0, pitch: float = 0.0) -> Pose:
    """Return a grip along x at x and height z [m], pitched up, then yawed [degrees]."""
    elevate = poses.exponential(math.radians(pitch) * np.array([0.0, -1.0, 0.0]))
    turn = poses.exponential(math.radians(yaw) * np.array([0.0, 0.0, 1.0]))
    return Pose(np.array([x, 0.0, z]), poses.multiply(turn, poses.multiply(elevate, ALONG_X)))


@dataclass(frozen=True)
class HeldRope:
    """Rope with held ends, at rest."""

    properties: RodProperties = ROPE
    left: Pose = level_grip(-0.12)
    right: Pose = level_grip(0.12)
    left_end: End = "clamped"
    right_end: End = "clamped"
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
        return Rod(self.properties, node_count, self.left_end, self.right_end, tolerance=1e-9)

    def rest(self, node_count: int) -> Rest:
        """Return the rest shape of the rod with some number of nodes."""
        rod = self.rod(node_count)
        rest = rod.rest(*self.grips)
        if turns := round(self.twist / (2.0 * np.pi)):
            rest = rod.rest(*self.grips, guess=add_turns(rest.state, turns))
        return rest

    def error(self, nodes: Float64[np.ndarray, "n 3"]) -> float:
        """Return the mean distance of nodes from the continuum [mm]."""
        exact = self.continuum.positions(len(nodes))
        return float(np.mean(1e3 * np.linalg.norm(nodes - exact, axis=1)))

    def rest_error(self, node_count: int) -> float:
        """Return the error of the rod at rest [mm]."""
        return self.error(self.rest(node_count).state.positions)

    def stiffer(self, factor: float) -> HeldRope:
        """Return the same rope with a multiple of its Young's modulus."""
        modulus = factor * self.properties.youngs_modulus
        return replace(self, properties=replace(self.properties, youngs_modulus=modulus))

    def apart(self, distance: float) -> HeldRope:
        """Return the same rope between level grips at a distance [m]."""
        return replace(self, left=level_grip(-distance / 2.0), right=level_grip(distance / 2.0))


BASE = HeldRope()
CLAMPED_ROPES: dict[str, HeldRope] = {
    "0.24 m apart": BASE,
    "E / 4": BASE.stiffer(0.25),
    "E x 4": BASE.stiffer(4.0),
    "0.12 m apart": BASE.apart(0.12),
    "0.12 m apart, E / 4": BASE.stiffer(0.25).apart(0.12),
    "0.36 m apart": BASE.apart(0.36),
    "0.42 m apart": BASE.apart(0.42),
    "right end 0.1 m higher": replace(BASE, right=level_grip(0.08, 0.1)),
    "pitched": replace(BASE, left=level_grip(-0.12, pitch=-40.0), right=level_grip(0.12, pitch=50)),
    "yawed": replace(BASE, left=level_grip(-0.12, yaw=35.0), right=level_grip(0.12, yaw=-60.0)),
    "yawed and pitched, E / 4": replace(
        BASE.stiffer(0.25),
        left=level_grip(-0.12, yaw=40.0, pitch=-30.0),
        right=level_grip(0.12, 0.05, yaw=25.0, pitch=20.0),
    ),
    "twisted by 2.5 rad": replace(BASE, twist=2.5),
    "yawed, one turn, E x 4": replace(
        BASE.stiffer(4.0),
        left=level_grip(-0.12, yaw=20.0),
        right=level_grip(0.12, yaw=30.0),
        twist=2.0 * math.pi,
    ),
    "naturally curved": HeldRope(replace(ROPE, rest_curvature=((4.0, 0.0, 3.0),))),
    "tapered": HeldRope(replace(ROPE, stiffness_profile=(0.5, 2.0), density_profile=(1.4, 0.6))),
}
"""Ropes between two clamps, by name."""
OTHER_ROPES: dict[str, HeldRope] = {
    "cantilever, E x 8": replace(BASE.stiffer(8.0), right_end="free"),
    "cantilever, E x 2": replace(BASE.stiffer(2.0), right_end="free"),
    "clamped and pinned": replace(BASE, right_end="pinned"),
    "pinned at both ends": replace(BASE, left_end="pinned", right_end="pinned"),
}
"""Ropes with a free or a pinned end, by name."""
ROPE_CASES = tuple(
    Case(name, "mm", rope.rest_error, (10, 20, 40, 80, 160, 320), {40: MAX_MEAN_ERROR}, MIN_ORDER)
    for name, rope in (CLAMPED_ROPES | OTHER_ROPES).items()
)
