"""Sections of the simulation that stands for the real cell."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

from lariat.configuration import Bounds
from lariat.scenario.sections.quantities import Color, Vector
from lariat.scenario.sections.rope import PlantRope


@dataclass(frozen=True)
class TrueGrip:
    """Error of a grip: where the rope is truly held, in the believed grip's frame."""

    offset: Annotated[Vector, Bounds(-0.05, 0.05, "m")] = (0.0, 0.0, 0.0)
    """Position at which the rope is held."""
    rotation: Annotated[Vector, Bounds(-45.0, 45.0, "deg")] = (0.0, 0.0, 0.0)
    """Rotation vector of the direction in which it is held."""


@dataclass(frozen=True)
class TrueGrips:
    """Errors of both grips, which the controller does not know."""

    left: TrueGrip = TrueGrip()
    right: TrueGrip = TrueGrip()


@dataclass(frozen=True)
class Slip:
    """Fault of a grip: the rope slips out of it during a run."""

    side: Literal["", "left", "right"] = ""
    """The grip; empty: both hold. For the model `links`."""
    time: Annotated[float, Bounds(0.0, 3600.0, "s")] = 0.0
    """Time since the start of the run."""


@dataclass(frozen=True)
class Plant:
    """Simulation that stands for the real cell."""

    model: Literal["rod", "mujoco", "links"] = "rod"
    """Simulator: Lariat's rod, MuJoCo's flex, or rigid links in MuJoCo, slower than real time."""
    rope: PlantRope = PlantRope()
    grips: TrueGrips = TrueGrips()
    slip: Slip = Slip()
    self_contact: bool = False
    """Whether strands of the model `rod` collide with each other."""
    friction: Annotated[float, Bounds(0.0, 5.0)] | None = None
    """Friction coefficient between rope and obstacles; by default 0 for `rod`, else 0.3."""
    color: Color = (255, 255, 255)
    """Colour of the rope: red, green, blue."""
    table_color: Color = (66, 70, 76)
    """Colour of the table and of every other half space."""
    camera_shift: Annotated[Vector, Bounds(-1.0, 1.0, "m")] = (0.0, 0.0, 0.0)
    """Displacement of the true camera from `[sensing]`."""
    camera_turn: Annotated[Vector, Bounds(-90.0, 90.0, "deg")] = (0.0, 0.0, 0.0)
    """Rotation vector of the true camera from `[sensing]`, in the world."""

    def __post_init__(self) -> None:
        if self.slip.side and self.model != "links":
            raise ValueError(
                f"slip: the rope of model = {self.model!r} cannot leave a grip; use model = 'links'"
            )
