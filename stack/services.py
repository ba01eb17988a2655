"""Services of a cell, and how one is built from a scenario."""

from __future__ import annotations

from importlib import import_module

from lariat.scenario import Scenario
from lariat.trajectory import SECOND
from shared.runtime.service import Service

NAMES = ("sim", "perception", "planner", "controller", "robot_gateway")
"""Services of the closed loop, in the direction of the data."""
LISTENERS = ("recorder", "dashboard")
"""Services whose outputs follow from the messages of all others."""
ALL = ("camera", *NAMES, *LISTENERS)
"""All services of a cell."""


def build(name: str, scenario: Scenario, session: str, first_step: int = SECOND) -> Service:
    """Create one service of the cell, for simulated time or for a replay.

    The gateway gets emulated arms in memory, whatever address the scenario gives them.

    Args:
        name: One of `NAMES`, or another package in services/ that has a `service.build`.
        scenario: The cell.
        session: Unique id of this start.
        first_step: Time of the service's first step [ns].

    Raises:
        ConfigurationError: The scenario asks for something that the service cannot do.
    """
    create = import_module(f"services.{name}.service").build
    if name == "robot_gateway":
        # The command-line tools of a live stack import this module without having the services.
        from stack.simulation.emulated_arms import emulated_links

        return create(scenario, session, links=emulated_links(scenario, first_step))
    return create(scenario, session)
