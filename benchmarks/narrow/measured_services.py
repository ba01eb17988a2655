"""Simulator and planner that also measure what a run does not publish."""

from __future__ import annotations

import time
from collections.abc import Iterator

import numpy as np

from lariat.geometry.swept_clearance import swept_clearance
from lariat.scenario import Scenario
from lariat.simulation.plants.end_motion import EndMotion
from lariat.simulation.world import World
from services.planner.service import PlannerService
from shared.runtime.service import Inbox, Publication

MIN_PLAN_TIME = 0.02
"""Processor time of the planner's step above which it counts as a plan [s]."""


class MeasuredWorld(World):
    """Simulated lab that measures the clearance of the true rope from one arm state to the next.

    Between two of them, 8 ms apart, the nodes move in straight lines.
    """

    def __init__(self, scenario: Scenario) -> None:
        super().__init__(scenario)
        self._radius = scenario.plant_rope.diameter / 2.0
        self.clearance = np.inf
        """Least distance between the surfaces of rope and obstacles [m]."""

    def advance(self, left: EndMotion, right: EndMotion, instant: int) -> None:
        """Move the grips to their new motion and the rope with them."""
        before = self.nodes
        super().advance(left, right, instant)
        chains = np.stack([before, self.nodes])
        self.clearance = min(self.clearance, swept_clearance(chains, self._radius, self.obstacles))


class TimedPlanner(PlannerService):
    """Planner that keeps the processor time of its plans."""

    def __init__(self, scenario: Scenario) -> None:
        super().__init__(scenario)
        self.plan_s: list[float] = []
        """Processor time of each plan [s]."""

    def step(self, inbox: Inbox, now: int) -> Iterator[Publication]:
        """Publish a path when one is due, and repeat the last one once a second."""
        began = time.process_time()
        published = list(super().step(inbox, now))
        took = time.process_time() - began
        if took > MIN_PLAN_TIME:
            self.plan_s.append(took)
        yield from published
