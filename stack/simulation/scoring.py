"""Scores a run by the true rope, which no service but the sim ever sees."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float64

from lariat.geometry import polylines
from lariat.geometry.obstacles import chain_clearance, signed_distance
from services.sim.marked_obstacles import MarkedObstacles
from shared import topics
from shared.messages import IDLE, chain, scene_obstacles
from shared.messages.parameters import named_parameters
from shared.scenario import Scenario
from shared.service import SECOND
from stack.simulation.horizon_error import HorizonError
from stack.simulation.simulated_time import Delivery

WINDOW = SECOND // 5
"""The final error is the mean over this time before the end [ns]."""
TOUCH = 0.0
"""Rope and obstacle are in contact at this distance and below [m]."""


@dataclass
class Scorer:
    """Sees every message of a run; the run begins when the task says so.

    Obstacles that the rope may lean on count neither for clearance nor for contact.
    """

    scenario: Scenario
    started: int = 0
    """Instant at which the run began [ns]; 0 before."""
    ended: int = 0
    """Stamp of the newest true rope [ns]."""
    min_clearance: float = np.inf
    """Least distance of surfaces [m]."""
    contact_time: float = 0.0
    """Time in contact [s]."""
    length_error: float = 0.0
    """Largest deviation of the true rope's length from the one it has at rest [m]."""
    errors: list[tuple[int, float, float]] = field(default_factory=list)
    """Stamp [ns], mean and largest node distance to the goal [m] of every true rope."""
    prediction_errors: list[float] = field(default_factory=list)
    """Mean node distance of prediction and observation [m]."""
    horizon_error: HorizonError = field(default_factory=HorizonError)
    """Of the run's horizons."""
    parameters: dict[str, list[float]] = field(default_factory=dict)
    """The newest: value and standard deviation by name."""
    replans: int = 0

    def __post_init__(self) -> None:
        self._marked = MarkedObstacles(self.scenario)
        self._believed = self.scenario.bodies
        self._surround()
        self._radius = self.scenario.plant_rope.diameter / 2.0
        self._goal: Float64[np.ndarray, "n 3"] | None = None
        self._first_replans = 0

    def __call__(self, delivery: Delivery) -> None:
        """Takes one message."""
        match delivery.key:
            case topics.TASK_STATE.key:
                self._take_task(delivery.parse())
                self._marked.update_task(delivery.parse(), delivery.received)
                self._surround()
            case topics.SCENE_REQUEST.key:
                self._marked.take_request(delivery.parse())
            case topics.SCENE_STATE.key:
                scene = delivery.parse()
                self._marked.take_scene(scene)
                self._believed = scene_obstacles(scene)
                self._surround()
            case topics.ROPE_TRUTH.key:
                message = delivery.parse()
                if self.started and message.stamp >= self.started:
                    nodes = chain(message.positions)
                    self._take_rope(message.stamp, nodes)
                    self.horizon_error.take_rope(message.stamp, nodes)
            case topics.CONTROLLER_PLAN.key:
                self.horizon_error.take_plan(delivery.parse())
            case topics.CONTROLLER_PARAMETERS.key:
                message = delivery.parse()
                self.parameters = {
                    p.name: [p.value, p.standard_deviation] for p in named_parameters(message)
                }
                if self.started:
                    self.prediction_errors.append(message.prediction_error)

    def _surround(self) -> None:
        """Obstacles as they truly are."""
        bodies = self._marked.merged(self._believed)
        self._obstacles = tuple(o for o in bodies if not o.support)

    def _take_task(self, task) -> None:
        if task.goal.positions:
            self._goal = chain(task.goal.positions)
        if not self.started:
            self._first_replans = task.replan_count
            if task.state != IDLE:
                self.started = task.run_started or task.stamp
        self.replans = task.replan_count - self._first_replans

    def _take_rope(self, stamp: int, nodes: Float64[np.ndarray, "n 3"]) -> None:
        since = self.ended or self.started
        self.ended = stamp
        if self._goal is not None:
            there = nodes
            if len(nodes) != len(self._goal):
                there = polylines.resample(nodes, len(self._goal))
            distances = np.linalg.norm(there - self._goal, axis=1)
            self.errors.append((stamp, float(np.mean(distances)), float(np.max(distances))))
        deviation = abs(polylines.length(nodes) - self.scenario.plant_rope.length)
        self.length_error = max(self.length_error, deviation)
        nearest = self._clearance(nodes)
        self.min_clearance = min(self.min_clearance, nearest)
        if nearest <= TOUCH:
            self.contact_time += (stamp - since) / SECOND

    def _clearance(self, nodes: Float64[np.ndarray, "n 3"]) -> float:
        """Least distance of surfaces, exact where it matters for the score, else infinite [m]."""
        edges = np.linalg.norm(np.diff(nodes, axis=0), axis=1)
        nearest = np.inf
        for obstacle in self._obstacles:
            distance = signed_distance(nodes, obstacle) - self._radius
            # A distance changes by no more than the way: no point of an edge is nearer than this.
            bound = np.min((distance[:-1] + distance[1:] - edges) / 2.0)
            if bound < max(self.min_clearance, TOUCH) and bound < nearest:
                nearest = min(nearest, chain_clearance(nodes, self._radius, [obstacle]))
        return nearest

    @property
    def final(self) -> tuple[float, float]:
        """Mean and largest node distance to the goal over the end of the run [m]."""
        last = [e for e in self.errors if e[0] > self.ended - WINDOW]
        if not last:
            return np.inf, np.inf
        return float(np.mean([e[1] for e in last])), float(np.mean([e[2] for e in last]))

    @property
    def reached_after(self) -> float | None:
        """Time from the start of the run to when the rope last came within tolerance [s]."""
        tolerance = self.scenario.run.tolerance
        if self.final[0] > tolerance:
            return None
        outside = [stamp for stamp, mean, _ in self.errors if mean > tolerance]
        after = outside[-1] if outside else -1
        within = next((e[0] for e in self.errors if e[0] > after), self.ended)
        return (within - self.started) / SECOND
