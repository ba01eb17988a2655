"""The runs behind the paper's figures: which method, through which rod, for which plant."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace

import numpy as np

from benchmarks.paper.closed_loop import ShapingRun, run_to_goal
from benchmarks.paper.goals import Goal, goals, scene, start
from lariat.rod import Rod
from lariat.rod.xpbd import XpbdRod
from lariat.trajectory import MotionLimits
from services.controller.model_factory import paper_rod
from services.controller.mpc.collision_avoidance import AvoidanceSpecification
from services.controller.mpc.gauss_newton import GaussNewton
from services.controller.mpc.horizon import HorizonOptimizer
from services.controller.mpc.objective import ObjectiveWeights
from services.controller.paper.adaptation import PaperAdaptation
from services.controller.paper.optimizer import PaperOptimizer
from services.controller.paper.policies import ACTIONS_RATE, Actions, Network
from shared.scenario.sections import Limits, PaperControl

LENGTH, DIAMETER, NODES = 0.45, 0.008, 40
PAPER = PaperControl()
UNTUNED = 1e-3
"""The network's learning rate, for the velocities themselves."""
SOFTER = 3.0
"""How many times as soft as believed the true rope of the adaptation study is."""
GAUSS_NEWTON_HORIZON, GAUSS_NEWTON_STEP = 15, 0.02
"""Steps, and of how long [s]: with longer ones the horizon's rod swings less than the plant."""
GAUSS_NEWTON_WEIGHTS = ObjectiveWeights(speed=0.01, acceleration=1e-5)
CLEARANCE = 0.025
"""That Gauss-Newton keeps between surfaces [m]."""


@dataclass(frozen=True)
class Study:
    """One method on all goals."""

    method: str
    """`network`, `actions` or `gauss_newton`."""
    solver: str
    """Of model and plant: `xpbd` or `direct`."""
    seed: int = 0
    """Of the network's first weights."""
    rate: float = ACTIONS_RATE
    """Of Adam on the velocities."""
    softer: float = 1.0
    """Compliance of the plant against the model's."""
    adapts: bool = False

    @property
    def name(self) -> str:
        """For tables and figures."""
        parts = [self.solver, self.method]
        if self.method == "network":
            parts.append(f"seed {self.seed}")
        if self.rate != ACTIONS_RATE:
            parts.append(f"rate {self.rate:g}")
        if self.softer != 1.0:
            parts.append(f"plant {self.softer:g} x as soft")
            parts.append("adapting" if self.adapts else "not adapting")
        return ", ".join(parts)


@dataclass(frozen=True)
class Outcome:
    """What came of a study."""

    study: Study
    runs: list[ShapingRun] = field(default_factory=list)

    def row(self) -> dict[str, float | str | int]:
        """Of the table."""
        errors = 1e3 * np.array([r.final_error for r in self.runs])
        times = 1e3 * np.concatenate([r.horizon_times for r in self.runs])
        return {
            "study": self.study.name,
            "goals": len(self.runs),
            "mean [mm]": round(float(np.mean(errors)), 3),
            "max [mm]": round(float(np.max(errors)), 3),
            "under 5 mm": int(np.sum(errors < 5.0)),
            "clearance [mm]": round(1e3 * min(r.clearance for r in self.runs), 1),
            "length off [mm]": round(1e3 * max(r.length_error for r in self.runs), 1),
            "horizon p50 [ms]": round(float(np.median(times)), 1),
            "p99 [ms]": round(float(np.percentile(times, 99)), 1),
        }


def studies(seeds: int) -> Iterator[Study]:
    """The paper's rod, then ours beside it."""
    for seed in range(seeds):
        yield Study("network", "xpbd", seed)
    yield Study("actions", "xpbd")
    yield Study("actions", "xpbd", rate=UNTUNED)
    yield Study("network", "direct")
    yield Study("actions", "direct")
    yield Study("gauss_newton", "direct")


def adaptation_studies() -> Iterator[Study]:
    """Figure 9, right: the rope is softer than the model believes."""
    yield Study("network", "xpbd", softer=SOFTER)
    yield Study("network", "xpbd", softer=SOFTER, adapts=True)


class Bench:
    """Holds the rods, so that kernels compile and goals are found once."""

    def __init__(self, seed: int) -> None:
        self.seed = seed
        self.xpbd = paper_rod(PAPER, LENGTH, DIAMETER, NODES)
        self.direct = Rod(self.xpbd.properties.material(NODES), NODES)
        self._goals: dict[tuple[str, float, int], list[Goal]] = {}

    def run(
        self, study: Study, count: int, steps: int, progress: Callable[[int, float], None]
    ) -> Outcome:
        """Brings the rope to all goals.

        Args:
            steps: T.
            progress: Told of goal and error after every horizon [m].
        """
        model = self.xpbd if study.solver == "xpbd" else self.direct
        plant = model
        if study.softer != 1.0:
            soft = study.softer * self.xpbd.properties.bending_compliance
            properties = replace(self.xpbd.properties, bending_compliance=soft)
            plant = self.xpbd.with_properties(properties)
        outcome = Outcome(study)
        begins = start(plant)
        avoidance = AvoidanceSpecification(scene(), CLEARANCE, DIAMETER / 2.0, 0.97 * LENGTH)
        for k, goal in enumerate(self._goals_of(study, plant, count)):
            adaptation = PaperAdaptation(self.xpbd, PAPER) if study.adapts else None
            outcome.runs.append(
                run_to_goal(
                    self._method(study),
                    model,
                    plant,
                    goal,
                    begins,
                    avoidance,
                    steps,
                    adaptation,
                    lambda error, k=k: progress(k, error),
                )
            )
        return outcome

    def direct_goals(self, count: int) -> list[Goal]:
        """The same goals as the continuous rod takes them."""
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
        policy = Actions(PAPER.horizon, free, study.rate)
        if study.method == "network":
            policy = Network(NODES, free, PAPER.learning_rate, study.seed)
        return PaperOptimizer(policy, PAPER, moves, MotionLimits(*[np.inf] * 6))
