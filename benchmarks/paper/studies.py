"""Studies behind the paper's figures: a method, a model and a plant, run to all goals."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace

import numpy as np

from benchmarks.paper.closed_loop import ShapingRun, run_to_goal
from benchmarks.paper.goals import Goal, goals, obstacles, start_state
from lariat.control.mpc.collision_avoidance import AvoidanceSpecification
from lariat.control.mpc.gauss_newton import GaussNewton
from lariat.control.mpc.horizon import HorizonOptimizer
from lariat.control.mpc.objective import ObjectiveWeights
from lariat.controllers import paper_rod
from lariat.paper.adaptation import PaperAdaptation
from lariat.paper.optimizer import PaperOptimizer
from lariat.paper.policies import ACTIONS_RATE, Actions, Network
from lariat.paper.xpbd import XpbdRod
from lariat.rod import Rod
from lariat.scenario.sections import Limits, PaperControl
from lariat.trajectory import MotionLimits

ROPE_LENGTH, ROPE_DIAMETER, NODE_COUNT = 0.45, 0.008, 40
"""Length and diameter of the rope [m], and its number of nodes."""
PAPER_CONTROL = PaperControl()
"""Settings of the paper's method."""
NETWORK_RATE = 1e-3
"""Learning rate of the network, tried for Adam on the velocities too."""
COMPLIANCE_RATIO = 3.0
"""Compliance of the plant relative to the model's, in the adaptation studies [-]."""
GAUSS_NEWTON_HORIZON, GAUSS_NEWTON_STEP = 15, 0.02
"""Number of steps, and time step [s]; with longer steps the model swings less than the plant."""
GAUSS_NEWTON_WEIGHTS = ObjectiveWeights(speed=0.01, acceleration=1e-5)
"""Weights of Gauss-Newton on speed and acceleration."""
GAUSS_NEWTON_CLEARANCE = 0.025
"""Clearance that Gauss-Newton keeps [m]."""
MAX_GRIP_DISTANCE_RATIO = 0.97
"""Largest distance of the grips, relative to the rope's length [-]."""


@dataclass(frozen=True)
class Study:
    """One method on all goals."""

    method: str
    """Method of control: `network`, `actions` or `gauss_newton`."""
    solver: str
    """Rod of model and plant: `xpbd` (the paper's) or `direct` (Lariat's)."""
    seed: int = 0
    """Seed of the network's initial weights."""
    rate: float = ACTIONS_RATE
    """Learning rate of Adam on the velocities."""
    softer: float = 1.0
    """Compliance of the plant relative to the model's [-]."""
    adapts: bool = False
    """Whether the model is adapted online."""
    mean_norm: bool = False
    """Whether (12) weighs the mean of the node distances, not their sum."""
    differentiates_inputs: bool = False
    """Whether the gradient goes through the network's inputs, too."""

    @property
    def name(self) -> str:
        """Name in tables and figures."""
        parts = [self.solver, self.method]
        if self.method == "network":
            parts.append(f"seed {self.seed}")
        if self.rate != ACTIONS_RATE:
            parts.append(f"rate {self.rate:g}")
        if self.mean_norm:
            parts.append("mean of the distances")
        if self.differentiates_inputs:
            parts.append("through its inputs")
        if self.softer != 1.0:
            parts.append(f"plant {self.softer:g} x as soft")
            parts.append("adapting" if self.adapts else "not adapting")
        return ", ".join(parts)


@dataclass(frozen=True)
class StudyResult:
    """Runs of a study to all goals."""

    study: Study
    """Method, model and plant."""
    runs: list[ShapingRun] = field(default_factory=list)
    """One run for each goal."""

    def row(self) -> dict[str, float | str | int]:
        """Row of the table."""
        errors = 1e3 * np.array([r.final_error for r in self.runs])
        times = 1e3 * np.concatenate([r.horizon_times for r in self.runs])
        return {
            "study": self.study.name,
            "goals": len(self.runs),
            "mean [mm]": round(float(np.mean(errors)), 3),
            "max [mm]": round(float(np.max(errors)), 3),
            "below 5 mm": int(np.sum(errors < 5.0)),
            "least clearance [mm]": round(1e3 * min(r.clearance for r in self.runs), 1),
            "length error [mm]": round(1e3 * max(r.length_error for r in self.runs), 1),
            "horizon p50 [ms]": round(float(np.median(times)), 1),
            "horizon p99 [ms]": round(float(np.percentile(times, 99)), 1),
        }


def studies(seeds: int) -> Iterator[Study]:
    """Yield the studies of the methods: on the paper's rod, then on Lariat's."""
    for seed in range(seeds):
        yield Study("network", "xpbd", seed)
    yield Study("network", "xpbd", mean_norm=True)
    yield Study("network", "xpbd", differentiates_inputs=True)
    yield Study("actions", "xpbd")
    yield Study("actions", "xpbd", rate=NETWORK_RATE)
    yield Study("network", "direct")
    yield Study("actions", "direct")
    yield Study("gauss_newton", "direct")


def adaptation_studies() -> Iterator[Study]:
    """Yield the studies of Fig. 9 (right): the plant is softer than the model."""
    yield Study("network", "xpbd", softer=COMPLIANCE_RATIO)
    yield Study("network", "xpbd", softer=COMPLIANCE_RATIO, adapts=True)


class StudyRunner:
    """Runner that keeps rods and goals, so that kernels compile and goals are found once."""

    def __init__(self, seed: int) -> None:
        self.seed = seed
        self.xpbd = paper_rod(PAPER_CONTROL, ROPE_LENGTH, ROPE_DIAMETER, NODE_COUNT)
        self.direct = Rod(self.xpbd.properties.material(NODE_COUNT), NODE_COUNT)
        self._goals: dict[tuple[str, float, int], list[Goal]] = {}

    def run(
        self, study: Study, count: int, steps: int, progress: Callable[[int, float], None]
    ) -> StudyResult:
        """Run a study to all goals.

        Args:
            study: Method, model and plant.
            count: Number of goals.
            steps: Number of steps T of each run.
            progress: Called with the number of the goal and the error [m] after every horizon.
        """
        model = self.xpbd if study.solver == "xpbd" else self.direct
        plant = model
        if study.softer != 1.0:
            soft = study.softer * self.xpbd.properties.bending_compliance
            properties = replace(self.xpbd.properties, bending_compliance=soft)
            plant = self.xpbd.with_properties(properties)
        result = StudyResult(study)
        initial_state = start_state(plant)
        avoidance = AvoidanceSpecification(
            obstacles(),
            GAUSS_NEWTON_CLEARANCE,
            ROPE_DIAMETER / 2.0,
            MAX_GRIP_DISTANCE_RATIO * ROPE_LENGTH,
        )
        for k, goal in enumerate(self._goals_of(study, plant, count)):
            adaptation = PaperAdaptation(self.xpbd, PAPER_CONTROL) if study.adapts else None
            result.runs.append(
                run_to_goal(
                    self._method(study),
                    model,
                    plant,
                    goal,
                    initial_state,
                    avoidance,
                    steps,
                    adaptation,
                    lambda error, k=k: progress(k, error),
                )
            )
        return result

    def direct_goals(self, count: int) -> list[Goal]:
        """Return the same goals as rest shapes of Lariat's rod."""
        return self._goals_of(Study("gauss_newton", "direct"), self.direct, count)

    def _goals_of(self, study: Study, plant: Rod | XpbdRod, count: int) -> list[Goal]:
        key = study.solver, study.softer, count
        if key not in self._goals:
            self._goals[key] = list(goals(plant, self.xpbd, count, self.seed))
        return self._goals[key]

    def _method(self, study: Study) -> HorizonOptimizer:
        moves = np.zeros((2, 6), dtype=bool)
        moves[:, :3] = True
        if study.method == "gauss_newton":
            return GaussNewton(
                moves,
                GAUSS_NEWTON_HORIZON,
                GAUSS_NEWTON_STEP,
                1,
                GAUSS_NEWTON_WEIGHTS,
                Limits(),
            )
        free = int(moves.sum())
        policy = Actions(PAPER_CONTROL.horizon, free, study.rate)
        if study.method == "network":
            policy = Network(NODE_COUNT, free, PAPER_CONTROL.learning_rate, study.seed)
        settings = PAPER_CONTROL
        if study.mean_norm:
            settings = replace(settings, error_weight=settings.error_weight / NODE_COUNT)
        unlimited = MotionLimits(*[np.inf] * 6)
        return PaperOptimizer(policy, settings, moves, unlimited, study.differentiates_inputs)
