"""What a path is sought for."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float64

from lariat.geometry.obstacles import Obstacle, pack
from lariat.geometry.poses import Pose
from lariat.rod import Rod, RodState
from shared.scenario.sections import Limits


@dataclass(frozen=True)
class Problem:
    """From a rope at rest to a goal, over or around obstacles."""

    rod: Rod
    state: RodState
    """Where the rope rests now."""
    grips: tuple[Pose, Pose]
    """Where the grips are now: left, right."""
    goal: Float64[np.ndarray, "n 3"]
    """Nodes of the wanted shape [m]."""
    goal_grips: tuple[Pose, Pose]
    """The grips that go with it, as a first guess where only nodes were given."""
    moves: Bool[np.ndarray, "2 6"]
    """Which components of each grip's velocity are free: translation, then rotation."""
    obstacles: tuple[Obstacle, ...]
    """All that must not be touched."""
    supports: tuple[Obstacle, ...]
    """What the rope may lean on."""
    limits: Limits
    clearance: float
    """Wanted between all surfaces [m]."""
    tolerance: float
    """Mean node distance that counts as reached [m]."""
    oriented: tuple[bool, bool] = (False, False)
    """Whether the orientation of each goal grip must be met."""
    turns: int = 0
    """Whole turns of twist that the goal asks for (`lariat.rod.twist`)."""
    seed: int = 0

    @property
    def solid(self) -> tuple[Obstacle, ...]:
        """All that the grippers must not touch: what the rope may lean on as well."""
        return self.obstacles + self.supports

    @property
    def packed_supports(self) -> Float64[np.ndarray, "m 12"] | None:
        """What the rope leans on, for the rod."""
        return pack(self.supports) if self.supports else None

    @property
    def radius(self) -> float:
        """Of the rope [m]."""
        return self.rod.properties.diameter / 2.0


@dataclass(frozen=True)
class WholePath:
    """Grips over time with the rope's shape along the way."""

    dt: float
    """Between points [s]."""
    positions: Float64[np.ndarray, "t 2 3"]
    """Of the grips [m]."""
    orientations: Float64[np.ndarray, "t 2 4"]
    """Of the grips, wxyz."""
    nodes: Float64[np.ndarray, "t n 3"]
    """[m]"""
    reached: bool
    reason: str
    """Why it does not reach the goal; empty when it does."""
    final_error: float
    """Mean node distance to the goal at its end, once at rest [m]."""
    clearance: float
    """Least distance of rope and grippers from obstacles along it [m]."""
    blocked: bool = False
    """Whether obstacles keep it from the goal: nearer than its end means nearer to them."""
