"""Description of the arm of an end, as far as the scenario itself gives it."""

from __future__ import annotations

import logging
from dataclasses import dataclass, replace
from pathlib import Path

from lariat.configuration import ConfigurationError
from lariat.protocols.arm import ArmFacts
from lariat.scenario import SIDES, Scenario, Side
from lariat.scenario.extensions import Extension
from lariat.scenario.sections import DRIVERS

log = logging.getLogger(__name__)

CR5_URDF = Path(__file__).with_name("cr5.urdf")
"""Nominal geometry of a CR5, with the collision cylinders of its links."""
CR5_FLANGE = "link_6"
"""Link of that URDF that carries the tool."""


@dataclass(frozen=True)
class ArmDescription:
    """URDF of an arm, and its flange."""

    urdf: Path
    flange: str


def with_own_urdfs(scenario: Scenario) -> Scenario:
    """Return a scenario in which each end states the URDF that its driver's class brings.

    The classes are imported: only for a scenario that a person has named, not for a recorded one.

    Args:
        scenario: The cell.
    """
    for side in SIDES:
        end = scenario.end(side)
        if end.driver in DRIVERS.included or end.urdf:
            continue
        named = Extension(f"ends.{side}.driver", end.driver, DRIVERS)
        try:
            facts = getattr(named.load(), "facts", None)
        except ConfigurationError as error:
            # The gateway needs the class; who only draws the arm can do without.
            log.warning("the %s arm is not drawn: %s", side, error)
            continue
        if isinstance(facts, ArmFacts) and facts.urdf and facts.flange:
            stated = replace(end, urdf=str(facts.urdf), flange=facts.flange)
            scenario = replace(scenario, ends=replace(scenario.ends, **{side: stated}))
    return scenario


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
