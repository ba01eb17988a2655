"""A cell without a bus: a true rope, grips that do as they are told, and a camera that is late."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from jaxtyping import Float64

from lariat.geometry.obstacles import TABLE, Obstacle
from lariat.geometry.poses import Pose
from lariat.rod import Rod, RodProperties, RolloutSpec
from lariat.trajectory import MotionState, mean_twists
from services.controller.estimation.material_filter import MaterialFilter
from services.controller.estimation.state_estimator import StateEstimator
from services.controller.model_factory import receding_horizon_controller
from services.controller.mpc.collision_avoidance import AvoidanceSpecification
from services.controller.mpc.reference_trajectory import ReferenceTrajectory
from shared.scenario.sections import Control, Limits

LEVEL = np.array([0.5, 0.5, 0.5, 0.5])
STEP = 20_000_000
PROPERTIES = RodProperties(0.45, 0.008, 0.044, 2e7)
COUNT = 24


def grips(left: tuple[float, float, float], right: tuple[float, float, float]) -> tuple[Pose, Pose]:
    """Level ones."""
    return Pose(np.array(left), LEVEL), Pose(np.array(right), LEVEL)


@dataclass
class Cell:
    """Steps controller and rope together."""

    stiffness_factor: float = 1.0
    """Of the true rope against the model."""
    noise: float = 0.0
    """Of a seen node [m]."""
    camera_delay: float = 0.05
    """[s]"""
    adapts: bool = False
    obstacles: tuple[Obstacle, ...] = (TABLE,)
    start: tuple[Pose, Pose] = field(
        default_factory=lambda: grips((-0.19, 0.0, 0.3), (0.19, 0.0, 0.3))
    )

    def __post_init__(self) -> None:
        self.model = Rod(PROPERTIES, COUNT)
        modulus = PROPERTIES.youngs_modulus * self.stiffness_factor
        self.plant = self.model.with_properties(replace(PROPERTIES, youngs_modulus=modulus))
        self.rope = self.plant.rest(*self.start).state
        self.now = 1_000_000_000
        self.arm = MotionState.at_rest(*self.start)
        self.estimate = StateEstimator(self.model, self.arm, self.now)
        moves = np.zeros((2, 6), dtype=bool)
        moves[:, :3] = True
        self.loop = receding_horizon_controller(Control(), Limits(), moves, self.estimate)
        self.adaptation = MaterialFilter(PROPERTIES)
        self.points: list[Float64[np.ndarray, "2 3"]] = []
        self._pictures: list[tuple[int, int, np.ndarray]] = []
        self._random = np.random.default_rng(1)
        self._steps = 0

    def follow(self, path: ReferenceTrajectory | None = None) -> None:
        """A path, or staying here."""
        standing = ReferenceTrajectory.standing(self.arm, self.estimate.nodes, STEP * 1e-9)
        self.loop.follow(path or standing, self.now)

    def run(self, seconds: float, goal: Float64[np.ndarray, "n 3"]) -> None:
        """Controls for a while."""
        avoidance = AvoidanceSpecification(self.obstacles, 0.012, 0.004, 0.97 * PROPERTIES.length)
        for _ in range(round(seconds / (STEP * 1e-9))):
            self.estimate.advance(self.arm, self.now)
            self._look()
            self.loop.step(self.now, goal, avoidance)
            row = self.loop.stream
            assert row is not None
            for k in range(1, 5):
                after = row.motion_at(self.now + k * STEP // 4)
                twist = mean_twists(self.arm, after, STEP * 1e-9 / 4).reshape(1, 2, 6)
                self.rope = self.plant.rollout(RolloutSpec(self.rope, twist, STEP * 1e-9 / 4)).final
                self.arm = after
            self.points.append(self.arm.positions)
            self.now += STEP
            self._steps += 1
            if self._steps % 2 == 0:
                seen = self.rope.positions
                seen = seen + self.noise * self._random.normal(size=seen.shape)
                self._pictures.append((self.now + round(self.camera_delay * 1e9), self.now, seen))

    def error(self, goal: Float64[np.ndarray, "n 3"]) -> float:
        """Mean node distance of the true rope to a goal [m]."""
        return float(np.mean(np.linalg.norm(self.rope.positions - goal, axis=1)))

    def _look(self) -> None:
        while self._pictures and self._pictures[0][0] <= self.now:
            _, stamp, nodes = self._pictures.pop(0)
            sigma, observed = np.full(COUNT, self.noise), np.ones(COUNT, dtype=bool)
            self.estimate.observe(stamp, nodes, sigma, observed)
            if not self.adapts:
                continue
            change = self.adaptation.update(self.estimate, stamp, nodes, sigma, observed)
            if change is not None:
                rod = self.model.with_properties(self.adaptation.properties)
                self.estimate.change_material(rod, change)
