"""Score of a run by the true rope, which only the simulation knows."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from jaxtyping import Float64

from lariat.geometry import polylines
from lariat.geometry.cable_routes import clip_names, held_clips
from lariat.geometry.obstacle_motion import ObstacleMotion, obstacles_at
from lariat.geometry.obstacles import Obstacle
from lariat.scenario import Goal, Scenario
from lariat.simulation.distractors import MovingTubes
from lariat.simulation.least_clearance import LeastClearance
from lariat.trajectory import NANOSECONDS, SECOND
from services.sim.marked_obstacles import MarkedObstacles
from shared import topics
from shared.messages import (
    IDLE,
    chain,
    goal_of,
    obstacle_motions,
    scene_obstacles,
)
from shared.messages.parameters import named_parameters
from stack.simulation.rope_errors import HorizonError, SensingError, TrueRope
from stack.simulation.simulated_time import Delivery

FINAL_ERROR_WINDOW = SECOND // 5
"""Time before the end of a run over which the final error is averaged [ns]."""
CURVE_POINTS = 1000
"""Points of the true rope's curve to which distances of the goal are measured."""
DENSE_POINTS = 250
"""Points of rope and distractor whose distances are measured: 2 mm apart on half a metre."""


@dataclass
class Scorer:
    """Tap that measures a run; the run begins when the task's state leaves idle.

    The border of a region to keep in counts as an obstacle. Supports count neither for the
    clearance nor for contact.
    """

    scenario: Scenario
    """Scenario of the run."""
    started: int = 0
    """Time at which the run began [ns]; 0 before."""
    ended: int = 0
    """Stamp of the newest true rope [ns]."""
    min_distractor_clearance: float = np.inf
    """Least distance between the surfaces of rope and distractors [m]."""
    certain_clearance: float = np.nan
    """Clearance that the newest path keeps with 99 %, where it is asked for [m]."""
    max_tension: float = 0.0
    """Largest tension of the true rope [N]."""
    length_error: float = 0.0
    """Largest deviation of the true rope's length from its length at rest [m]."""
    errors: list[tuple[int, float, float]] = field(default_factory=list)
    """Stamp [ns], mean and largest node distance to the goal [m] of each true rope."""
    angles: list[float] = field(default_factory=list)
    """Angle of the ends of each true rope from a goal that they alone make up [rad]."""
    prediction_errors: list[float] = field(default_factory=list)
    """Mean node distance between prediction and observation, by message [m]."""
    horizon_error: HorizonError = field(default_factory=HorizonError)
    """Prediction error of the run's horizons."""
    sensing_error: SensingError = field(default_factory=SensingError)
    """Error of the perceived rope."""
    parameters: dict[str, list[float]] = field(default_factory=dict)
    """Newest value and standard deviation of each estimated parameter by name."""
    ropes: list[Float64[np.ndarray, "n 3"]] = field(default_factory=list)
    """Nodes of each true rope [m]."""
    stamps: list[int] = field(default_factory=list)
    """Stamp of each true rope [ns]."""
    scenes: list[tuple[Obstacle, ...]] = field(default_factory=list)
    """True obstacles at each true rope."""
    arms: list[bytes] = field(default_factory=list)
    """Encoded `ArmStates` at each true rope."""
    estimates: list[tuple[int, dict[str, list[float]]]] = field(default_factory=list)
    """Stamp [ns], and values and standard deviations of all parameters by name."""
    replans: int = 0
    """Number of new paths that the controller requested during the run."""

    def __post_init__(self) -> None:
        self._marked = MarkedObstacles(self.scenario)
        self._believed = self.scenario.bodies
        self._motions: tuple[ObstacleMotion, ...] = ()
        self._update_obstacles()
        self._distractors = MovingTubes(self.scenario.distractors)
        self._radius = self.scenario.plant_rope.diameter / 2.0
        self._clearance = LeastClearance(self._radius)
        self._goal: Goal | None = None
        self._nodes: Float64[np.ndarray, "n 3"] | None = None
        self._first_replans = 0
        self._newest_arms = b""

    def __call__(self, delivery: Delivery) -> None:
        """Process one message."""
        match delivery.key:
            case topics.TASK_STATE.key:
                message = delivery.parse()
                self._take_task(message)
                self._marked.update_task(message, delivery.received)
                self._update_obstacles()
            case topics.SCENE_REQUEST.key:
                self._marked.take_request(delivery.parse())
            case topics.SCENE_STATE.key:
                scene = delivery.parse()
                self._marked.take_scene(scene)
                self._believed = scene_obstacles(scene)
                self._update_obstacles()
            case topics.SCENE_MOTION.key:
                self._motions = obstacle_motions(delivery.parse())
            case topics.ROPE_TRUTH.key:
                message = delivery.parse()
                if self.started and message.stamp >= self.started:
                    self.max_tension = max(self.max_tension, message.tension)
                    rope = TrueRope(message.stamp, chain(message.positions))
                    self._take_rope(rope)
                    self.horizon_error.take_rope(rope)
                    self.sensing_error.take_rope(rope)
            case topics.ARM_STATE.key:
                self._newest_arms = delivery.payload
            case topics.ROPE_NODES.key:
                message = delivery.parse()
                if message.positions:
                    nodes = chain(message.positions)
                    seen = np.array(message.observed or [True] * len(nodes))
                    self.sensing_error.take_seen(message.stamp, nodes, seen)
            case topics.CONTROLLER_PATH.key if self.scenario.control.certain_clearance is not None:
                self.certain_clearance = delivery.parse().certain_clearance
            case topics.CONTROLLER_PLAN.key:
                self.horizon_error.take_plan(delivery.parse())
            case topics.CONTROLLER_PARAMETERS.key:
                message = delivery.parse()
                self.parameters = {
                    p.name: [p.value, p.standard_deviation] for p in named_parameters(message)
                }
                if self.started:
                    self.estimates.append((message.stamp, self.parameters))
                    self.prediction_errors.append(message.prediction_error)

    def _update_obstacles(self) -> None:
        """Update the true obstacles."""
        bodies = self._marked.merged(self._believed)
        self._obstacles = (*(o for o in bodies if not o.support), *self.scenario.regions)

    def _take_task(self, task) -> None:
        if task.goal.positions:
            self._goal = goal_of(task.goal)
        if not self.started:
            self._first_replans = task.replan_count
            if task.state != IDLE:
                self.started = task.run_started or task.stamp
        self.replans = task.replan_count - self._first_replans

    def _take_rope(self, rope: TrueRope) -> None:
        stamp, nodes = rope.stamp, rope.nodes
        since = self.ended or self.started
        self.ended = stamp
        self._nodes = nodes
        if self._goal is not None:
            resampled = nodes
            if len(nodes) != len(self._goal.nodes):
                resampled = rope.resampled(len(self._goal.nodes))
            distances = np.linalg.norm(resampled - self._goal.nodes, axis=1)[self._goal.counted]
            self.errors.append((stamp, float(np.mean(distances)), float(np.max(distances))))
            self.angles.append(self._goal.angle(nodes))
        deviation = abs(polylines.length(nodes) - self.scenario.plant_rope.length)
        self.length_error = max(self.length_error, deviation)
        self._take_distractors(stamp, nodes)
        obstacles = obstacles_at(self._obstacles, self._motions, stamp * NANOSECONDS)
        self._clearance.take(stamp - since, nodes, obstacles)
        self.stamps.append(stamp)
        self.ropes.append(nodes)
        self.scenes.append(obstacles)
        self.arms.append(self._newest_arms)

    @property
    def series(self) -> dict[str, Any]:
        """Fields of a `SimulatedRun` that follow from the messages."""
        errors = np.full((len(self.stamps), 2), np.nan)
        errors[len(errors) - len(self.errors) :] = [e[1:] for e in self.errors] or np.zeros((0, 2))
        names = self.estimates[-1][1] if self.estimates else {}
        estimates = [values for _, values in self.estimates if values.keys() == names.keys()]
        stamps = [stamp for stamp, values in self.estimates if values.keys() == names.keys()]
        count = self.scenario.plant_rope.node_count
        return {
            "goal": self._goal,
            "times": (np.array(self.stamps, dtype=np.int64) - self.started) / SECOND,
            "nodes": np.array(self.ropes) if self.ropes else np.zeros((0, count, 3)),
            "errors": errors,
            "parameter_times": (np.array(stamps, dtype=np.int64) - self.started) / SECOND,
            "parameters": {n: np.array([values[n] for values in estimates]) for n in names},
            "scenes": tuple(self.scenes),
            "arms": tuple(self.arms),
        }

    def _take_distractors(self, stamp: int, nodes: Float64[np.ndarray, "n 3"]) -> None:
        tubes = self._distractors.at((stamp - self.started) / SECOND)
        rope = polylines.resample(nodes, DENSE_POINTS) if tubes else nodes
        for tube in tubes:
            gap = np.min(
                polylines.point_distances(rope, polylines.resample(tube.nodes, DENSE_POINTS))
            )
            clearance = float(gap) - tube.radius - self._radius
            self.min_distractor_clearance = min(self.min_distractor_clearance, clearance)

    @property
    def min_clearance(self) -> float:
        """Least distance between the surfaces of rope and obstacles [m]."""
        return self._clearance.least

    @property
    def clips_held(self) -> list[str] | None:
        """Clips of the goal's route that hold the rope; None without a route."""
        if self._goal is None or not self._goal.route or self._nodes is None:
            return None
        bodies = self._marked.merged(self._believed)
        return held_clips(self._goal.route, bodies, self._nodes)

    @property
    def contact_time(self) -> float:
        """Time in contact [s]."""
        return self._clearance.contact_time

    @property
    def final(self) -> tuple[float, float]:
        """Mean and largest node distance to the goal, averaged over the end of the run [m]."""
        last = [e for e in self.errors if e[0] > self.ended - FINAL_ERROR_WINDOW]
        if not last:
            return np.inf, np.inf
        return float(np.mean([e[1] for e in last])), float(np.mean([e[2] for e in last]))

    @property
    def final_angle(self) -> float | None:
        """Angle of the rope's ends from a goal that they alone make up, at the end [rad]."""
        if self._goal is None or not self._goal.ends_only or not self.angles:
            return None
        last = [
            angle
            for (stamp, *_), angle in zip(self.errors, self.angles, strict=True)
            if stamp > self.ended - FINAL_ERROR_WINDOW
        ]
        return float(np.mean(last))

    @property
    def final_shape_error(self) -> float:
        """Mean distance of the goal's nodes from the curve of the true rope, at the end [m].

        A rope that lies on the goal but is shifted along itself has no such error.
        """
        if self._goal is None or self._nodes is None:
            return np.inf
        curve = polylines.resample_smooth(self._nodes, CURVE_POINTS)
        goal_nodes = self._goal.nodes[self._goal.counted]
        return float(np.mean(np.min(polylines.point_distances(goal_nodes, curve), axis=1)))

    @property
    def reached_after(self) -> float | None:
        """Time from the start of the run until the rope was within tolerance for good [s]."""
        tolerance, angle = self.scenario.run.tolerance, self.scenario.run.angle_tolerance
        if self.clips_held is not None and self.clips_held != clip_names(self._goal.route):
            return None
        if self.final[0] > tolerance or (self.final_angle or 0.0) > angle:
            return None
        outside = [
            stamp
            for (stamp, mean, _), turned in zip(self.errors, self.angles, strict=True)
            if mean > tolerance or turned > angle
        ]
        after = outside[-1] if outside else -1
        within = next((e[0] for e in self.errors if e[0] > after), self.ended)
        return (within - self.started) / SECOND
