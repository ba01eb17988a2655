"""Description of the arm of an end, as far as the scenario itself gives it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from shared.scenario import Scenario, Side

CR5_URDF = Path(__file__).parents[1] / "cr5" / "cr5.urdf"
"""Nominal geometry of a CR5, with the collision cylinders of its links."""
CR5_FLANGE = "link_6"
"""Link of that URDF that carries the tool."""


@dataclass(frozen=True)
class ArmDescription:
    """URDF of an arm, and its flange."""

    urdf: Path
    flange: str


def arm_description(scenario: Scenario, side: Side) -> ArmDescription | None:
    """Return the description of an end's arm.

    None for an end without an arm, and for a driver from outside that brings its own URDF.

    Args:
        scenario: The cell.
        side: End of the rope.
    """
    end = scenario.end(side)
    if end.driver == "cr5":
        return ArmDescription(CR5_URDF, CR5_FLANGE)
    if end.urdf and end.flange:
        return ArmDescription(scenario.folder / end.urdf, end.flange)
    return None
