"""The paper's experiments with a rope and a cable: closed-loop runs through camera and arm.

Rope and cable are those of `scenarios/rope.toml` and `scenarios/cable.toml`, with three goals each.
The true rope is the same in all experiments; the controller believes a wrong stiffness.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import product

import numpy as np
from jaxtyping import Float64

from lariat.geometry.poses import Pose
from lariat.scenario import Rope, Scenario, load
from lariat.scenario.cameras import DEFAULT_CAMERA
from lariat.scenario.rod_properties import rod_properties
from lariat.scenario.shipped import find
from lariat.trajectory import SECOND
from shared import topics
from shared.messages import arm_pose, chain, poses_known, stamp_of
from stack.scenario_overrides import load_with
from stack.simulation import closed_loop
from stack.simulation.closed_loop import Score, Watch
from stack.simulation.simulated_time import Delivery

ROPES = ("rope", "cable")
"""Names of the scenarios."""
GOALS = (1, 2, 3)
"""Numbers of the goals."""
TIME_AFTER_GOAL = 1.5
"""Time for which a run goes on after its goal is reached [s]."""
IMAGE_PERIOD = SECOND // 5
"""Time between two kept camera images [ns]."""


@dataclass(frozen=True)
class Experiment:
    """Rope, goal, believed stiffness, and whether the controller adapts."""

    rope: str
    """One of `ROPES`."""
    goal: int
    """One of `GOALS`."""
    belief: float
    """Believed stiffness relative to the true one [-]."""
    adapt: bool
    """Whether the controller adapts the rope's parameters."""

    @property
    def name(self) -> str:
        """Description for progress and messages."""
        return (
            f"{self.rope}, goal {self.goal}, believed {self.belief:g} times as stiff, "
            f"{'adapting' if self.adapt else 'not adapting'}"
        )


@dataclass
class Trace:
    """Tap that keeps the messages of a run from which figures are drawn."""

    truth: list[tuple[int, Float64[np.ndarray, "n 3"]]] = field(default_factory=list)
    """Stamps [ns] and nodes of the true rope [m]."""
    perceived: list[tuple[int, Float64[np.ndarray, "n 3"]]] = field(default_factory=list)
    """Stamps [ns] and nodes of the perceived rope [m]."""
    images: list[tuple[int, bytes]] = field(default_factory=list)
    """Stamps [ns] and JPEG images."""
    grips: list[tuple[int, Pose, Pose]] = field(default_factory=list)
    """Stamps [ns], left and right grips."""

    def __call__(self, delivery: Delivery) -> None:
        """Take one message."""
        match delivery.key:
            case topics.ROPE_TRUTH.key | topics.ROPE_NODES.key:
                message = delivery.parse()
                if message.positions:
                    rows = self.truth if delivery.key == topics.ROPE_TRUTH.key else self.perceived
                    rows.append((message.stamp, chain(message.positions)))
            case topics.ARM_STATE.key:
                states = delivery.parse()
                if poses_known(states):
                    left, right = (arm_pose(states, side) for side in ("left", "right"))
                    self.grips.append((states.stamp, left, right))
            case key if key == topics.CAMERA_COLOR.at(DEFAULT_CAMERA).key:
                message = delivery.parse()
                stamp = stamp_of(message)
                if not self.images or stamp - self.images[-1][0] >= IMAGE_PERIOD:
                    self.images.append((stamp, message.data))


@dataclass(frozen=True)
class ExperimentRun:
    """Finished run of an experiment."""

    experiment: Experiment
    scenario: Scenario
    score: Score
    reason: str
    """Reason why it ended."""
    started: int
    """Stamp of its start [ns]."""
    errors: list[tuple[float, float]]
    """Times since the start [s] and mean node errors of the true rope [m]."""
    trace: Trace

    @property
    def true_stiffness(self) -> float:
        """EI of the true rope, before its stiffness profile [N m^2]."""
        return bending_stiffness(self.scenario.plant_rope)

    @property
    def believed_stiffness(self) -> float:
        """EI that the controller believed at the start [N m^2]."""
        return bending_stiffness(self.scenario.rope)

    @property
    def adapted_stiffness(self) -> tuple[float, float]:
        """EI that the controller believed at the end, and its standard deviation [N m^2]."""
        value, deviation = self.score.parameters["bending_stiffness"]
        return value, deviation


def bending_stiffness(rope: Rope) -> float:
    """EI of a scenario's rope [N m^2]."""
    return rod_properties(rope).bending_stiffness


def experiments(beliefs: tuple[float, ...]) -> Iterator[Experiment]:
    """Yield all combinations of rope, belief, goal and adaptation."""
    for rope, belief, goal, adapt in product(ROPES, beliefs, GOALS, (True, False)):
        yield Experiment(rope, goal, belief, adapt)


def scenario(
    experiment: Experiment, resolution: tuple[int, int], depth_noise: float, time_limit: float
) -> Scenario:
    """Return the scenario of an experiment.

    Args:
        experiment: Rope, goal, belief and adaptation.
        resolution: Width and height of the camera's images [pixels].
        depth_noise: Standard deviation of a depth pixel [m].
        time_limit: Duration of the run [s].
    """
    path = find(experiment.rope)
    true = load(path).plant_rope.youngs_modulus
    settings = (
        f"name={experiment.rope}-{experiment.goal}",
        f"goal.nodes=goals/{experiment.rope}-{experiment.goal}.csv",
        f"rope.youngs_modulus={experiment.belief * true}",
        f"control.adapt={'true' if experiment.adapt else 'false'}",
        f"sensing.resolution={list(resolution)}",
        f"sensing.depth_noise={depth_noise}",
        f"run.time_limit={time_limit}",
    )
    return load_with(path, settings)


def run_experiment(
    experiment: Experiment, cell: Scenario, watch: Watch | None = None
) -> ExperimentRun:
    """Run an experiment in its scenario.

    Args:
        experiment: Rope, goal, belief and adaptation.
        cell: Scenario of the experiment.
        watch: Called during the run, as by `closed_loop.run`.
    """
    trace = Trace()
    outcome = closed_loop.run(cell, stop_after=TIME_AFTER_GOAL, watch=watch, taps=(trace,))
    started = outcome.scorer.started
    errors = [((stamp - started) / SECOND, mean) for stamp, mean, _ in outcome.scorer.errors]
    # Not the outcome itself: its stack holds cameras, rods and arms.
    return ExperimentRun(experiment, cell, outcome.score, outcome.reason, started, errors, trace)
