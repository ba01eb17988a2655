"""Choice of rod, optimizer and adaptation from a scenario's `control` section."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from jaxtyping import Bool

from lariat.configuration import ConfigurationError
from lariat.control.estimation.adaptation import Adaptation
from lariat.control.estimation.arm_lag import CR5_LAG
from lariat.control.estimation.material_filter import MaterialFilter
from lariat.control.estimation.state_estimator import StateEstimator
from lariat.control.extensions.controller_adapter import ControllerAdapter
from lariat.control.extensions.estimator_adapter import EstimatorAdapter
from lariat.control.mpc.gauss_newton import GaussNewton
from lariat.control.mpc.horizon import HorizonOptimizer
from lariat.control.mpc.objective import ObjectiveWeights
from lariat.control.mpc.receding_horizon import RecedingHorizonController
from lariat.control.run.live_settings import OF_EVERY_METHOD
from lariat.paper.optimizer import PaperOptimizer
from lariat.paper.xpbd import XpbdProperties, XpbdRod
from lariat.rod import Rod
from lariat.safety.motion_contract import OFFSET_LIMIT_SHARE, PATHLESS_LIMIT_SHARE
from lariat.scenario import SIDES, Scenario
from lariat.scenario.extensions import extension
from lariat.scenario.sections import (
    CONTROL_METHODS,
    STATE_ESTIMATORS,
    Control,
    Limits,
    PaperControl,
)
from lariat.trajectory import MotionLimits, MotionState

ADAPTING_PLACE_WEIGHT = 0.3
"""Weight of a node's place along the rope, relative to its distance across it, while length and
grips are being learnt [-]. A camera does not see that place, and the goal of a rope that is longer
or shorter than the model cannot be met node by node: the rope would be bent to make up for it."""


_PAPER_KEYS = (
    "paper.horizon",
    "paper.time_step",
    "paper.optimizer_steps",
    "paper.learning_rate",
    "paper.error_weight",
    "paper.obstacle_weight",
    "paper.speed_weight",
    "paper.obstacle_distance",
)
OPTIMIZER_KEYS: Mapping[str, tuple[str, ...]] = {
    "gauss_newton": ("horizon", "time_step", "iterations", "speed_weight", "acceleration_weight"),
    "network": _PAPER_KEYS,
    "actions": _PAPER_KEYS,
}
"""Keys of the section `control` from which `horizon_optimizer` creates one, by method: a new one
may take the place of another while a run goes on."""


def live_keys(control: Control) -> tuple[str, ...]:
    """Keys of a section `control` that act while its cell runs."""
    return OF_EVERY_METHOD + OPTIMIZER_KEYS.get(control.method, ())


def check(scenario: Scenario) -> None:
    """Check that method, solver and adaptation of a scenario fit together.

    Raises:
        ConfigurationError: They do not.
    """
    control = scenario.control
    if control.solver == "direct":
        return
    if control.method not in ("network", "actions"):
        raise ConfigurationError(
            f"control.solver = 'xpbd' gives no sensitivities to method {control.method!r}; use "
            "method 'network' or 'actions', or solver 'direct'"
        )
    if control.state_estimator != "rod":
        raise ConfigurationError(
            f"control.state_estimator = {control.state_estimator!r} needs control.solver = 'direct'"
        )
    if control.adapt and any(scenario.end(side).rotates for side in SIDES):
        raise ConfigurationError(
            "control.adapt with control.solver = 'xpbd' is the paper's, whose ends do not rotate; "
            "set rotates = false, or solver = 'direct'"
        )


def prediction_rod(scenario: Scenario, rod: Rod) -> Rod | XpbdRod:
    """Rod that a scenario's controller predicts with.

    Args:
        scenario: Scenario with its control section.
        rod: Continuous rod, which shapes goals in any case.
    """
    if scenario.control.solver == "direct":
        return rod
    return _paper_rod_of(scenario)


def paper_rod(settings: PaperControl, length: float, diameter: float, node_count: int) -> XpbdRod:
    """Rod of the paper with the parameters of its Table 1.

    Args:
        settings: The paper's parameters.
        length: Length of the rope [m].
        diameter: Diameter of the rope [m].
        node_count: Nodes of the rope.
    """
    properties = XpbdProperties(
        length,
        diameter,
        settings.mass,
        settings.inertia,
        settings.linear_damping,
        settings.angular_damping,
        settings.bending_compliance,
    )
    return XpbdRod(properties, node_count, iterations=settings.iterations)


def _paper_rod_of(scenario: Scenario) -> XpbdRod:
    rope = scenario.rope
    return paper_rod(scenario.control.paper, rope.length, rope.diameter, rope.node_count)


def adaptation(scenario: Scenario, rod: Rod) -> Adaptation:
    """Adaptation of the material of the rod that a scenario's controller predicts with.

    Args:
        scenario: Scenario with its control section.
        rod: Continuous rod.
    """
    if scenario.control.solver == "direct":
        return MaterialFilter(rod.properties)
    # Imported late, as below: PyTorch is installed where the paper's methods are wanted.
    from lariat.paper.adaptation import PaperAdaptation

    return PaperAdaptation(_paper_rod_of(scenario), scenario.control.paper)


def state_estimator(
    control: Control, rod: Rod | XpbdRod, motion: MotionState, time: int
) -> StateEstimator:
    """State estimator that `control.state_estimator` names.

    Args:
        control: Control section of a scenario.
        rod: Rod that the controller predicts with.
        motion: Motion of the grips.
        time: Time of that motion [ns].

    Raises:
        ConfigurationError: An estimator from outside cannot be created.
    """
    own = extension("control.state_estimator", control.state_estimator, STATE_ESTIMATORS)
    if own is None:
        return StateEstimator(rod, motion, time)
    assert isinstance(rod, Rod)
    return EstimatorAdapter(own, rod, motion, time)


def horizon_optimizer(
    control: Control,
    moves: Bool[np.ndarray, "2 6"],
    limits: MotionLimits,
    node_count: int,
) -> HorizonOptimizer:
    """Optimizer of Lariat's own that `control.method` names.

    Args:
        control: Control section of a scenario.
        moves: Free components of each grip's velocity.
        limits: Limits on the motion relative to the reference trajectory.
        node_count: Nodes of the rope.

    Raises:
        ValueError: It names a controller from outside.
    """
    paper = control.paper
    free = int(moves.sum())
    match control.method:
        case "gauss_newton":
            weights = ObjectiveWeights(
                control.speed_weight,
                control.acceleration_weight,
                ADAPTING_PLACE_WEIGHT if control.adapt else 1.0,
            )
            return GaussNewton(
                moves, control.horizon, control.time_step, control.iterations, weights, limits
            )
        case "actions":
            from lariat.paper.policies import Actions

            policy = Actions(paper.horizon, free)
        case "network":
            from lariat.paper.policies import Network

            policy = Network(node_count, free, paper.learning_rate, seed=0)
        case _:
            raise ValueError(f"control.method = {control.method!r} is no optimizer of Lariat's own")
    return PaperOptimizer(policy, paper, moves, limits)


def expected_lag(scenario: Scenario) -> float:
    """Lag behind their setpoints that a scenario's arms are expected to have [s]."""
    drivers = [scenario.end(side).driver for side in SIDES]
    return CR5_LAG if "cr5" in drivers else 0.0


def receding_horizon_controller(
    control: Control,
    limits: Limits,
    moves: Bool[np.ndarray, "2 6"],
    estimator: StateEstimator,
    expected_lag: float = 0.0,
) -> RecedingHorizonController:
    """Controller of a scenario.

    Args:
        control: Control section of a scenario.
        limits: Limits of the grippers.
        moves: Free components of each grip's velocity.
        estimator: State estimator of the rope.
        expected_lag: Lag of the arms before they have moved [s].

    Raises:
        ConfigurationError: A controller from outside cannot be created.
    """
    # Without a planned path all of the limits is for the optimizer.
    share = OFFSET_LIMIT_SHARE if control.planner else PATHLESS_LIMIT_SHARE
    offset_limits = limits.scaled(share)
    own = extension("control.method", control.method, CONTROL_METHODS)
    if own is None:
        optimizer = horizon_optimizer(control, moves, offset_limits, estimator.rod.node_count)
    else:
        rod = estimator.rod
        assert isinstance(rod, Rod)
        reach = limits.overstretch * rod.properties.length
        optimizer = ControllerAdapter(own, rod, moves, limits, control.clearance, reach)
    return RecedingHorizonController(
        estimator, optimizer, moves, offset_limits, limits, expected_lag
    )
