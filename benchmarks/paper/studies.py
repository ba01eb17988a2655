"""Studies behind the paper's figures: a method, a model and a plant, run to each goal."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Literal

import numpy as np

from benchmarks.campaign import Trial
from benchmarks.paper.closed_loop import FINAL_STEPS, PAPER_TIME_STEP, run_to_goal
from benchmarks.paper.goals import BASE_SCENARIO, START_GRIPS, Nodes, goals, obstacles
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
from lariat.scenario import Rope, Shape, load
from lariat.scenario.sections import Limits, PaperControl, Plant, PlantRope
from lariat.trajectory import MotionLimits
from stack.simulation import closed_loop

ROPE_LENGTH, ROPE_DIAMETER, NODE_COUNT = 0.45, 0.008, 40
"""Length and diameter of the rope [m], and its number of nodes."""
PAPER_CONTROL = PaperControl()
"""Settings of the paper's method."""
COMPLIANCE_RATIO = 3.0
"""Compliance of the plant relative to the model's, in the adaptation studies [-]."""
GAUSS_NEWTON_HORIZON, GAUSS_NEWTON_STEP = 15, 0.02
"""Number of steps, and time step [s]; with longer steps the model swings less than the plant."""
GAUSS_NEWTON_WEIGHTS = ObjectiveWeights(speed=0.01, acceleration=1e-5)
"""Weights of Gauss-Newton on speed and acceleration."""
GAUSS_NEWTON_CLEARANCE, PATH_CLEARANCE = 0.025, 0.02
"""Clearance that Gauss-Newton keeps, and that paths keep [m]."""
MAX_GRIP_DISTANCE_RATIO = 0.97
"""Largest distance of the grips, relative to the rope's length [-]."""
LINEAR_DENSITY = 0.044
"""Linear density of the rope in the stack [kg/m]; with all stiffnesses in proportion it moves like
the paper's."""


@dataclass(frozen=True)
class Study:
    """One method on all goals."""

    method: Literal["network", "actions", "gauss_newton", "whole_path"]
    """Method of control; `whole_path` is Lariat's whole stack."""
    solver: Literal["xpbd", "direct"]
    """Rod of model and plant: the paper's, or Lariat's."""
    seed: int = 0
    """Seed of the network's initial weights."""
    softer: float = 1.0
    """Compliance of the plant relative to the model's [-]."""
    adapts: bool = False
    """Whether the model is adapted online."""

    @property
    def name(self) -> str:
        """Name in tables and figures."""
        if self.method == "whole_path":
            return "direct, gauss_newton along a planned path, through the gateway"
        parts = [self.solver, self.method]
        if self.method == "network":
            parts.append(f"seed {self.seed}")
        if self.softer != 1.0:
            parts.append(f"plant {self.softer:g} x as soft")
            parts.append("adapting" if self.adapts else "not adapting")
        return ", ".join(parts)


def studies(seeds: int) -> Iterator[Study]:
    """Yield the studies of the methods: on the paper's rod, then on Lariat's."""
    for seed in range(seeds):
        yield Study("network", "xpbd", seed)
    yield Study("actions", "xpbd")
    yield Study("network", "direct")
    yield Study("actions", "direct")
    yield Study("gauss_newton", "direct")
    yield Study("whole_path", "direct")


ADAPTATION_STUDIES = tuple(
    Study("network", "xpbd", softer=COMPLIANCE_RATIO, adapts=adapts) for adapts in (False, True)
)
"""Studies of Fig. 9 (right): the plant is softer than the model."""


@dataclass(frozen=True)
class ShapingSpec:
    """Run to one goal."""

    study: Study
    goal: int
    """Number of the goal."""
    seed: int
    """Seed of the goals."""
    steps: int
    """Number of steps T of the run."""


def error_mm(trial: Trial) -> float:
    """Return the mean node distance to the goal over the last 0.2 s [mm]."""
    return float(np.mean(trial["errors_mm"][-FINAL_STEPS:]))


def run_trial(spec: ShapingSpec) -> Trial:
    """Run one study to one goal; see `run_to_goal`. By the whole stack, the end alone is known."""
    study = spec.study
    xpbd, direct = rods()
    model = xpbd if study.solver == "xpbd" else direct
    goal = _goal(study.solver, study.softer, spec.seed, spec.goal)
    if study.method == "whole_path":
        return _by_the_stack(spec, direct, goal)
    avoidance = AvoidanceSpecification(
        obstacles(),
        GAUSS_NEWTON_CLEARANCE,
        ROPE_DIAMETER / 2.0,
        MAX_GRIP_DISTANCE_RATIO * ROPE_LENGTH,
    )
    adaptation = PaperAdaptation(xpbd, PAPER_CONTROL) if study.adapts else None
    plant = _plant(study.solver, study.softer)
    return run_to_goal(_method(study), model, plant, goal, avoidance, spec.steps, adaptation)


@cache
def rods() -> tuple[XpbdRod, Rod]:
    """Return the paper's rod and Lariat's, of the same material."""
    xpbd = paper_rod(PAPER_CONTROL, ROPE_LENGTH, ROPE_DIAMETER, NODE_COUNT)
    return xpbd, Rod(xpbd.properties.material(NODE_COUNT), NODE_COUNT)


@cache
def _plant(solver: str, softer: float) -> Rod | XpbdRod:
    xpbd, direct = rods()
    if softer == 1.0:
        return xpbd if solver == "xpbd" else direct
    compliance = softer * xpbd.properties.bending_compliance
    return xpbd.with_properties(replace(xpbd.properties, bending_compliance=compliance))


@cache
def _goals(solver: str, softer: float, seed: int) -> tuple[Iterator[Nodes], list[Nodes]]:
    """Goals of a plant: those to come, and those that are drawn."""
    return goals(_plant(solver, softer), rods()[0], seed), []


def _goal(solver: str, softer: float, seed: int, number: int) -> Nodes:
    further, drawn = _goals(solver, softer, seed)
    while len(drawn) <= number:
        drawn.append(next(further))
    return drawn[number]


def _method(study: Study) -> HorizonOptimizer:
    moves = np.zeros((2, 6), dtype=bool)
    moves[:, :3] = True
    if study.method == "gauss_newton":
        horizon = GAUSS_NEWTON_HORIZON, GAUSS_NEWTON_STEP
        return GaussNewton(moves, *horizon, 1, GAUSS_NEWTON_WEIGHTS, Limits())
    free = int(moves.sum())
    policy = Actions(PAPER_CONTROL.horizon, free, ACTIONS_RATE)
    if study.method == "network":
        policy = Network(NODE_COUNT, free, PAPER_CONTROL.learning_rate, study.seed)
    return PaperOptimizer(policy, PAPER_CONTROL, moves, MotionLimits(*[np.inf] * 6))


def _by_the_stack(spec: ShapingSpec, rod: Rod, goal: Nodes) -> Trial:
    """Run by the whole stack: planned path, Gauss-Newton control, gateway with the arms' limits.

    The plant is Lariat's rod; the controller perceives the true nodes and does not adapt.
    """
    base, p = load(BASE_SCENARIO), rod.properties
    ratio = LINEAR_DENSITY / p.linear_density
    rope = Rope(
        length=p.length,
        diameter=p.diameter,
        node_count=NODE_COUNT,
        linear_density=LINEAR_DENSITY,
        youngs_modulus=p.youngs_modulus * ratio,
        poisson_ratio=p.poisson_ratio,
        stretch_stiffness=p.stretch_stiffness * ratio,
        damping=p.damping,
    )
    left, right = (tuple(grip.tolist()) for grip in START_GRIPS)
    scenario = replace(
        base,
        name=f"paper-{spec.goal}",
        rope=rope,
        plant=Plant(model="rod", rope=PlantRope(node_count=rod.node_count)),
        sensing=replace(base.sensing, source="truth"),
        control=replace(base.control, clearance=PATH_CLEARANCE),
        start=Shape(line=(left, right)),
        goal=Shape(nodes=goal),
        run=replace(base.run, time_limit=spec.steps * PAPER_TIME_STEP),
    )
    score = closed_loop.run(scenario).score
    error, clearance = score.final_error_mm, score.min_clearance_mm
    return {
        "errors_mm": [np.inf if error is None else error],
        "clearance_mm": np.nan if clearance is None else clearance,
        "length_error_mm": score.length_error_mm,
        "horizon_ms": (score.plan_ms["p50"], score.plan_ms["p99"]),
    }


def row(study: Study, trials: Sequence[Trial]) -> dict[str, object]:
    """Return the row of a study's runs; times are medians over them."""
    errors = [error_mm(t) for t in trials]
    p50, p99 = np.median([t["horizon_ms"] for t in trials], axis=0).round(1).tolist()
    return {
        "study": study.name,
        "goals": len(trials),
        "mean [mm]": round(float(np.mean(errors)), 3),
        "max [mm]": round(max(errors), 3),
        "below 5 mm": sum(error < 5.0 for error in errors),
        "least clearance [mm]": round(min(t["clearance_mm"] for t in trials), 1),
        "length error [mm]": round(max(t["length_error_mm"] for t in trials), 1),
        "horizon p50 [ms]": p50,
        "horizon p99 [ms]": p99,
    }


def adaptation_row(study: Study, trials: Sequence[Trial]) -> dict[str, object]:
    """Return prediction errors, adapted parameters and times of a study with a softer plant."""
    row: dict[str, object] = {
        "study": study.name,
        "prediction error, second half [mm]": float(np.mean([t["prediction_mm"] for t in trials])),
    }
    for name in trials[0]["parameters"]:
        row[name] = float(np.mean([t["parameters"][name] for t in trials]))
    if study.adapts:
        row["adaptation p50 [ms]"] = float(np.median([t["adaptation_ms"] for t in trials]))
    return row
