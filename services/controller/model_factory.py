"""Which rod predicts: the continuous one, or the paper's with the parameters of its Table 1."""

from __future__ import annotations

from lariat.rod import Rod
from lariat.rod.xpbd import XpbdProperties, XpbdRod
from services.controller.estimation.material_filter import Adaptation
from services.controller.paper.adaptation import PaperAdaptation
from shared.configuration import ConfigurationError
from shared.scenario import SIDES, Scenario
from shared.scenario.sections import PaperControl


def model_of(scenario: Scenario, rod: Rod) -> Rod | XpbdRod:
    """The rod that a scenario's controller predicts with.

    Args:
        rod: The continuous one, which shapes goals in any case.
    """
    if scenario.control.solver == "direct":
        return rod
    rope = scenario.rope
    return paper_rod(scenario.control.paper, rope.length, rope.diameter, rope.node_count)


def paper_rod(settings: PaperControl, length: float, diameter: float, nodes: int) -> XpbdRod:
    """The rod of Table 1."""
    properties = XpbdProperties(
        length,
        diameter,
        settings.mass,
        settings.inertia,
        settings.linear_damping,
        settings.angular_damping,
        settings.bending_compliance,
    )
    return XpbdRod(properties, nodes, iterations=settings.iterations)


def adaptation_of(scenario: Scenario, model: Rod | XpbdRod) -> Adaptation | PaperAdaptation:
    """What learns a model's material."""
    if isinstance(model, XpbdRod):
        return PaperAdaptation(model, scenario.control.paper)
    return Adaptation(model.properties)


def check(scenario: Scenario) -> None:
    """Raises ConfigurationError where the parts do not fit together."""
    control = scenario.control
    if control.solver == "direct":
        return
    if control.method == "gauss_newton":
        raise ConfigurationError(
            "control.solver = 'xpbd' gives no sensitivities to method 'gauss_newton'; use method "
            "'network' or 'actions', or solver 'direct'"
        )
    if control.adapt and any(scenario.end(side).rotates for side in SIDES):
        raise ConfigurationError(
            "control.adapt with control.solver = 'xpbd' is the paper's, whose ends do not rotate; "
            "set rotates = false, or solver = 'direct'"
        )
