"""Closed loop without a bus: a true rope, grips that follow exactly, and a camera with delay."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from jaxtyping import Float64

from lariat.control.estimation.adaptation import apply_material
from lariat.control.estimation.material_filter import MaterialFilter
from lariat.control.estimation.rope_observation import RopeObservation
from lariat.control.estimation.state_estimator import StateEstimator
from lariat.control.mpc.collision_avoidance import AvoidanceSpecification
from lariat.control.mpc.reference_trajectory import ReferenceTrajectory
from lariat.controllers import receding_horizon_controller
from lariat.geometry.obstacles import TABLE, Obstacle
from lariat.geometry.poses import Pose
from lariat.rod import Rod, RodProperties, RolloutSpec
from lariat.scenario.sections import Control, Limits
from lariat.trajectory import MotionState, mean_twists

LEVEL = np.array([0.5, 0.5, 0.5, 0.5])
"""Orientation of a level grip, wxyz."""
STEP = 20_000_000
"""Period of the controller [ns]."""
PROPERTIES = RodProperties(0.45, 0.008, 0.044, 2e7)
"""Properties of the model."""
COUNT = 24
"""Nodes of the rope."""


def grips(left: tuple[float, float, float], right: tuple[float, float, float]) -> tuple[Pose, Pose]:
    """Level grips at two positions [m]."""
    return Pose(np.array(left), LEVEL), Pose(np.array(right), LEVEL)


@dataclass
class Cell:
    """True rope, its controller and its camera, stepped together."""

    stiffness_factor: float = 1.0
    """Stiffness of the true rope relative to the model's [-]."""
    noise: float = 0.0
    """Standard deviation of an observed node [m]."""
    camera_delay: float = 0.05
    """Age of an observation when it arrives [s]."""
    arm_lag: float = 0.0
    """Time by which the arms are behind their setpoints, a multiple of 5 ms [s]."""
    adapts: bool = False
    """Whether the material is learnt."""
    max_stretch: float = np.inf
    """Stretch that the controller allows, as a share of the model's length [-]."""
    obstacles: tuple[Obstacle, ...] = (TABLE,)
    """Obstacles to avoid."""
    start: tuple[Pose, Pose] = field(
        default_factory=lambda: grips((-0.19, 0.0, 0.3), (0.19, 0.0, 0.3))
    )
    """Grips at the start."""

    def __post_init__(self) -> None:
        self.model = Rod(PROPERTIES, COUNT)
        modulus = PROPERTIES.youngs_modulus * self.stiffness_factor
        self.plant = self.model.with_properties(replace(PROPERTIES, youngs_modulus=modulus))
        self.rope = self.plant.rest(*self.start).state
        self.now = 1_000_000_000
        self.arm = MotionState.at_rest(*self.start)
        self.estimator = StateEstimator(self.model, self.arm, self.now)
        moves = np.zeros((2, 6), dtype=bool)
        moves[:, :3] = True
        self.controller = receding_horizon_controller(Control(), Limits(), moves, self.estimator)
        self.adaptation = MaterialFilter(PROPERTIES)
        self.grip_positions: list[Float64[np.ndarray, "2 3"]] = []
        self._commanded = [self.arm]
        self._plans: list[tuple[float, np.ndarray]] = []
        self._history: list[tuple[float, np.ndarray]] = []
        self._images: list[tuple[int, int, np.ndarray]] = []
        self._random = np.random.default_rng(1)
        self._steps = 0

    def follow(self, path: ReferenceTrajectory | None = None) -> None:
        """Follow a path, or stay at the present grips."""
        standing = ReferenceTrajectory.standing(self.arm, self.estimator.nodes, STEP * 1e-9)
        self.controller.follow(path or standing, self.now)

    def run(self, seconds: float, goal: Float64[np.ndarray, "n 3"]) -> None:
        """Control the rope for some seconds."""
        avoidance = AvoidanceSpecification(
            self.obstacles, 0.012, 0.004, 0.97 * PROPERTIES.length, self.max_stretch
        )
        for _ in range(round(seconds / (STEP * 1e-9))):
            self.estimator.advance(self.arm, self.now)
            self._observe()
            command = self.controller.step(self.now, goal, avoidance)
            horizon = self.controller.optimizer.step_count * self.controller.optimizer.time_step
            end = 1e-9 * command.plan_start + horizon
            self._plans.append((end, command.plan.nodes[-1]))
            stream = self.controller.stream
            assert stream is not None
            for k in range(1, 5):
                self._commanded.append(stream.motion_at(self.now + k * STEP // 4))
                after = self._commanded[
                    max(-1 - round(self.arm_lag / 0.005), -len(self._commanded))
                ]
                twist = mean_twists(self.arm, after, STEP * 1e-9 / 4).reshape(1, 2, 6)
                self.rope = self.plant.rollout(RolloutSpec(self.rope, twist, STEP * 1e-9 / 4)).final
                self.arm = after
                time = 1e-9 * (self.now + k * STEP // 4)
                self._history.append((time, self.rope.positions))
            self.grip_positions.append(self.arm.positions)
            self.now += STEP
            self._steps += 1
            if self._steps % 2 == 0:
                nodes = self.rope.positions
                nodes = nodes + self.noise * self._random.normal(size=nodes.shape)
                self._images.append((self.now + round(self.camera_delay * 1e9), self.now, nodes))

    def error(self, goal: Float64[np.ndarray, "n 3"]) -> float:
        """Mean node distance of the true rope to a goal [m]."""
        return float(np.mean(np.linalg.norm(self.rope.positions - goal, axis=1)))

    def horizon_errors(self) -> Float64[np.ndarray, "h"]:
        """Root mean square node error at the end of every horizon that has passed [m]."""
        times = np.array([time for time, _ in self._history])
        nodes = np.array([nodes for _, nodes in self._history])
        errors = []
        for end, predicted in self._plans:
            if end > times[-1]:
                break
            after = int(np.searchsorted(times, end))
            share = (times[after] - end) / (times[after] - times[after - 1])
            true = share * nodes[after - 1] + (1.0 - share) * nodes[after]
            errors.append(np.sqrt(np.mean(np.sum((predicted - true) ** 2, axis=1))))
        return np.array(errors)

    def _observe(self) -> None:
        """Hand over the images whose delay has passed."""
        while self._images and self._images[0][0] <= self.now:
            _, stamp, nodes = self._images.pop(0)
            sigma, observed = np.full(COUNT, self.noise), np.ones(COUNT, dtype=bool)
            self.estimator.observe(RopeObservation(stamp, nodes, sigma, observed))
            if not self.adapts:
                continue
            change = self.adaptation.update(
                self.estimator, RopeObservation(stamp, nodes, sigma, observed)
            )
            if change is not None:
                apply_material(self.estimator, self.adaptation, change, moving=True)
