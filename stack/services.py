"""Services of a cell, and how one is built from a scenario."""

from __future__ import annotations

from importlib import import_module

from shared.scenario import Scenario
from shared.service import Service

NAMES = ("sim", "perception", "planner", "controller", "robot_gateway")
"""Services of the closed loop, in the direction of the data."""


def build(name: str, scenario: Scenario, session: str) -> Service:
    """Service of a cell, built from its scenario.

    Args:
        name: One of `NAMES`, or another package in services/ that has a `service.build`.
        session: Unique id of this start.

    Raises:
        ConfigurationError: The scenario asks for what the service cannot do.
    """
    return import_module(f"services.{name}.service").build(scenario, session)
