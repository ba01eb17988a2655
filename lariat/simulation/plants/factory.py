"""Plant of a scenario."""

from __future__ import annotations

from dataclasses import fields, replace

from lariat.rod import RodProperties
from lariat.scenario import Scenario
from lariat.scenario.rod_properties import rod_properties
from lariat.scenario.sections import TrueGrips
from lariat.simulation.plants.plant import Plant
from lariat.simulation.plants.true_grips import TrueGripsPlant


def true_properties(scenario: Scenario) -> RodProperties:
    """Properties of the true rope, which the controller does not know."""
    hidden = scenario.plant.rope
    properties = rod_properties(scenario.plant_rope)
    return replace(
        properties,
        stiffness_profile=hidden.stiffness_profile or properties.stiffness_profile,
        rest_curvature=(hidden.rest_curvature,),
    )


def build_plant(scenario: Scenario) -> Plant:
    """Build the plant of a scenario, without bringing it to the scenario's start.

    Its grips are those that the arms report, with the errors of `plant.grips` behind them.
    """
    plant = _plant_of_true_grips(scenario)
    exact = scenario.plant.grips == TrueGrips()
    return plant if exact else TrueGripsPlant(plant, scenario.plant.grips)


def _plant_of_true_grips(scenario: Scenario) -> Plant:
    properties = true_properties(scenario)
    count = scenario.plant_rope.node_count
    if scenario.plant.model == "rod":
        from lariat.simulation.plants.rod_plant import RodPlant

        own = scenario.plant
        return RodPlant(properties, count, scenario.bodies, own.self_contact, own.friction or 0.0)
    # Imported here: a cell with the rod as its plant does not need MuJoCo.
    from lariat.simulation.plants.flex_rope import FlexRope
    from lariat.simulation.plants.linked_rope import LinkedRope
    from lariat.simulation.plants.mujoco_plant import MujocoPlant
    from lariat.simulation.plants.mujoco_rope import MujocoRope

    own = {field.name for field in fields(MujocoRope)}
    rope_properties = {key: value for key, value in vars(properties).items() if key in own}
    rope = MujocoRope(
        **rope_properties
        | {
            "node_count": count,
            "stiffness_profile": scenario.plant.rope.stiffness_profile,
            "rest_curvature": scenario.plant.rope.rest_curvature,
            "layers": tuple((share, limit) for share, limit, _ in properties.layers.tolist()),
        }
        | ({} if scenario.plant.friction is None else {"friction": scenario.plant.friction})
    )
    kind = LinkedRope if scenario.plant.model == "links" else FlexRope
    return MujocoPlant(kind(rope), scenario.bodies)
