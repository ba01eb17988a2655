"""Rod as a chain of nodes: material, discretization, kind of ends, solver settings."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Generic, Literal, Protocol, TypeVar, get_args

import numpy as np
from jaxtyping import Float64

from lariat.rod.integration_schemes import HISTORY_LENGTHS, Scheme
from lariat.rod.launch.layout import CLAMP_WEIGHTS
from lariat.rod.properties import RodProperties

End = Literal["free", "pinned", "clamped"]
"""Hold of an end: none, of its position, or of its position and direction."""
ENDS: tuple[End, ...] = get_args(End)
"""All holds of an end; the place of a hold is its `EndHold`."""
MIN_NODE_COUNT = 5
"""Smallest number of nodes of a rod."""


class Dimensions(Protocol):
    """Properties that every rod has."""

    @property
    def length(self) -> float:
        """Rest length [m]."""
        ...

    @property
    def diameter(self) -> float:
        """Diameter [m]."""
        ...


PropertiesT_co = TypeVar("PropertiesT_co", bound=Dimensions, covariant=True)


@dataclass(frozen=True)
class RodModel(Generic[PropertiesT_co]):
    """Chain of nodes with a material; the part that all rods have in common.

    Raises:
        ValueError: A field is out of its range.
    """

    properties: PropertiesT_co
    """Material and dimensions."""
    node_count: int
    """Number of nodes, at least 5."""
    left: End = "clamped"
    """Hold of the end at node 0."""
    right: End = "clamped"
    """Hold of the end at the last node."""
    gravity: tuple[float, float, float] = (0.0, 0.0, -9.81)
    """Gravitational acceleration in the world frame [m/s^2]."""

    def __post_init__(self) -> None:
        if self.node_count < MIN_NODE_COUNT:
            raise ValueError(
                f"node_count must be at least {MIN_NODE_COUNT}, got {self.node_count}; try 40"
            )
        for name, end in (("left", self.left), ("right", self.right)):
            if end not in ENDS:
                raise ValueError(f"{name} must be one of {', '.join(ENDS)}, got {end!r}")
        if len(self.gravity) != 3 or not all(map(math.isfinite, self.gravity)):
            raise ValueError(f"gravity must be three finite numbers, got {self.gravity} m/s^2")

    @property
    def edge_length(self) -> float:
        """Rest length of an edge [m]."""
        return self.properties.length / (self.node_count - 1)

    @property
    def clamps(self) -> tuple[int, int]:
        """Number of clamps at the left and at the right end, 0 or 1."""
        return int(self.left == "clamped"), int(self.right == "clamped")

    @property
    def frame_count(self) -> int:
        """Number of frames m: one for each edge, and one for the grip of each clamp."""
        return self.node_count - 1 + sum(self.clamps)

    @property
    def bend_lengths(self) -> Float64[np.ndarray, "m-1"]:
        """Length over which the bend between two frames acts: an edge, times `CLAMP_WEIGHTS` at
        clamps [m]."""
        lengths = np.full(self.frame_count - 1, self.edge_length)
        left, right = self.clamps
        if left:
            lengths[:2] *= CLAMP_WEIGHTS
        if right:
            lengths[:-3:-1] *= CLAMP_WEIGHTS
        return lengths

    @property
    def bend_places(self) -> Float64[np.ndarray, "m-1"]:
        """Arc length of each bend, at a node, over the rod's length, from the left [-]."""
        return (np.arange(self.frame_count - 1) + 1.0 - self.clamps[0]) / (self.node_count - 1)


@dataclass(frozen=True)
class ImplicitRodModel(RodModel[RodProperties]):
    """Chain of nodes whose steps minimize an energy; see `lariat.rod.Rod`."""

    tolerance: float = 1e-7
    """Largest displacement of a node in the last Newton step of a converged solve [m]."""
    scheme: Scheme = "euler"
    """Time integration scheme."""
    self_contact: bool = False
    """Whether strands of the rod collide with each other."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 0.0 < self.tolerance < self.properties.length:
            raise ValueError(
                f"tolerance must be positive and less than the length, got {self.tolerance} m; "
                "try 1e-7"
            )
        if self.scheme not in HISTORY_LENGTHS:
            raise ValueError(
                f"scheme must be one of {', '.join(HISTORY_LENGTHS)}, got {self.scheme!r}"
            )
