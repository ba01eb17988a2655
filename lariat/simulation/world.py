"""Simulated lab: the true rope, its obstacles, and its clock, which follows the arms."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from jaxtyping import Float64

from lariat.geometry.obstacles import Obstacle
from lariat.geometry.poses import Pose
from lariat.scenario import SIDES, Scenario, Side
from lariat.simulation.plants.end_motion import EndMotion, interpolate
from lariat.simulation.plants.factory import build_plant
from lariat.simulation.plants.winding import wind

MAX_PLANT_STEP = 0.05
"""Longest step of the plant [s]; a longer time between two arm states is divided into steps."""
MAX_GAP = 10.0
"""Time between two instants beyond which the later one needs a confirmation [s]."""


class World:
    """Rope between its grips, at the time of the last arm state that moved it."""

    def __init__(self, scenario: Scenario) -> None:
        self._scenario = scenario
        self._plant = build_plant(scenario)
        self.obstacles: tuple[Obstacle, ...] = scenario.bodies
        self._far_instant: int | None = None
        self.instant: int | None = None
        """Time in the lab [ns]; None until the first arm state."""
        self.reset()

    @property
    def nodes(self) -> Float64[np.ndarray, "n 3"]:
        """Nodes of the true rope, left end first [m]."""
        return self._plant.nodes

    @property
    def tension(self) -> float:
        """Largest tension along the true rope [N]."""
        return self._plant.tension

    @property
    def grips(self) -> tuple[Pose, Pose]:
        """Poses of the left and the right grip."""
        return self._ends[0].pose, self._ends[1].pose

    def reset(self) -> None:
        """Return to the scenario's start, at rest."""
        scenario = self._scenario
        left, right = scenario.grips(scenario.start)
        self._plant.reset(left, right, scenario.nodes(scenario.start))
        self._ends = (EndMotion(left), EndMotion(right))
        wind(self._plant, left, right, scenario.start.turns)

    def release(self, side: Side) -> None:
        """Let the rope slip out of a grip, until the next reset."""
        self._plant.release(SIDES.index(side))

    def set_obstacles(self, obstacles: Sequence[Obstacle]) -> None:
        """Replace all obstacles."""
        if tuple(obstacles) != self.obstacles:
            self.obstacles = tuple(obstacles)
            self._plant.set_obstacles(self.obstacles)

    def advance(self, left: EndMotion, right: EndMotion, instant: int) -> None:
        """Move the grips to their new motion and the rope with them.

        Args:
            left: Left grip at `instant`.
            right: Right grip at `instant`.
            instant: Time in the lab [ns]; a time that is not later than the present one is ignored.
        """
        if self.instant is None:
            self.instant = instant
            self._ends = (left, right)
            self._plant.step(left, right, 0.0)
            return
        duration = (instant - self.instant) / 1e9
        if duration <= 0.0:
            return
        if duration > MAX_GAP:
            self._skip_gap(left, right, instant)
            return
        count = math.ceil(duration / MAX_PLANT_STEP)
        ends = (left, right)
        if count > 1:
            times = duration / count * np.arange(1, count)
            paths = interpolate(self._ends, ends, duration, times)
            for k in range(count - 1):
                between = (EndMotion(Pose(p[k], q[k])) for p, q in zip(*paths, strict=True))
                self._plant.step(*between, duration / count)
        self._plant.step(*ends, duration / count)
        self._ends = (left, right)
        self.instant = instant

    def _skip_gap(self, left: EndMotion, right: EndMotion, instant: int) -> None:
        """Go on at a far instant when a second one confirms it, without the time in between.

        The machine may have slept; a single far stamp is an error of whoever sent it.
        """
        far, self._far_instant = self._far_instant, instant
        if far is None or not 0 < instant - far < MAX_GAP * 1e9:
            return
        self._plant.step(left, right, MAX_PLANT_STEP)
        self._ends, self.instant, self._far_instant = (left, right), instant, None

    def hold(self, instant: int) -> None:
        """Let time pass until `instant` [ns] with both grips at rest where they are."""
        left, right = (EndMotion(pose) for pose in self.grips)
        self.advance(left, right, instant)
