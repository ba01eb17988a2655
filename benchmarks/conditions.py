"""Conditions on which the figures of a closed-loop run depend: plant, sensing, adaptation."""

from __future__ import annotations

from dataclasses import dataclass

from lariat.scenario import Scenario

PLANT_NAMES = {"mujoco": "MuJoCo", "links": "rigid links", "rod": "Lariat's rod"}
"""Names of the plants, by `plant.model` of a scenario."""


@dataclass(frozen=True)
class Conditions:
    """Plant, sensing and adaptation of a run, in words for tables."""

    plant: str
    """Simulator of the true rope, its number of nodes n, and that of the controller's rod."""
    sensed: str
    """Source of the perceived rope: the simulated camera, or the true nodes."""
    adapting: str
    """Whether the controller adapts the rope's parameters: yes or no."""

    @classmethod
    def of(cls, scenario: Scenario) -> Conditions:
        """Conditions of a scenario."""
        sensing = scenario.sensing
        if sensing.source == "camera":
            width, height = sensing.resolution
            sensed = f"camera, {width} x {height}, depth noise {1e3 * sensing.depth_noise:g} mm"
        else:
            sensed = f"truth, node noise {1e3 * sensing.node_noise:g} mm"
        return cls(
            f"{PLANT_NAMES[scenario.plant.model]}, n = {scenario.plant_rope.node_count} "
            f"(model: {scenario.rope.node_count})",
            sensed,
            "yes" if scenario.control.adapt else "no",
        )

    def __str__(self) -> str:
        return f"plant: {self.plant}; sensed: {self.sensed}; adapting: {self.adapting}"
