"""The paper's experiments with a rope and a cable, each a whole run through camera and arm.

Rope and cable lie in `scenarios/rope.toml` and `scenarios/cable.toml`, three goals each beside
them. The true rope is always the same; what the controller believes of its stiffness is wrong by a
factor.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import product
from pathlib import Path

import numpy as np
from jaxtyping import Float64

from lariat.geometry.poses import Pose
from lariat.rod import RodProperties
from shared import topics
from shared.messages import arm_pose, chain, poses_known, stamp_of
from shared.scenario import Scenario, load
from shared.service import SECOND
from stack.scenario_overrides import load_with
from stack.simulation import closed_loop
from stack.simulation.closed_loop import Score, Watch
from stack.simulation.simulated_time import Delivery

SCENARIOS = Path(__file__).parents[2] / "scenarios"
ROPES = ("rope", "cable")
GOALS = (1, 2, 3)
AFTERWARDS = 1.5
"""A run goes on for so long after the controller has said that the goal is reached [s]."""
PICTURE_EVERY = SECOND // 5
"""Between kept camera images [ns]."""


@dataclass(frozen=True)
class Case:
    """One run."""

    rope: str
    goal: int
    belief: float
    """Believed over true stiffness."""
    adapt: bool

    @property
    def name(self) -> str:
        """In words."""
        return (
            f"{self.rope}, goal {self.goal}, believed {self.belief:g} times as stiff, "
            f"{'adapting' if self.adapt else 'not adapting'}"
        )


@dataclass
class Trace:
    """What was said in a run, as far as pictures need it."""

    truth: list[tuple[int, Float64[np.ndarray, "n 3"]]] = field(default_factory=list)
    """Stamp [ns] and nodes of the true rope [m]."""
    seen: list[tuple[int, Float64[np.ndarray, "n 3"]]] = field(default_factory=list)
    """The same of what perception said."""
    pictures: list[tuple[int, bytes]] = field(default_factory=list)
    """Stamp and JPEG."""
    grips: list[tuple[int, Pose, Pose]] = field(default_factory=list)
    """Stamp, left and right grip."""

    def __call__(self, delivery: Delivery) -> None:
        """Takes one message."""
        match delivery.key:
            case topics.ROPE_TRUTH.key | topics.ROPE_NODES.key:
                message = delivery.parse()
                if message.positions:
                    rows = self.truth if delivery.key == topics.ROPE_TRUTH.key else self.seen
                    rows.append((message.stamp, chain(message.positions)))
            case topics.ARM_STATE.key:
                states = delivery.parse()
                if poses_known(states):
                    left, right = (arm_pose(states, side) for side in ("left", "right"))
                    self.grips.append((states.stamp, left, right))
            case key if key == topics.CAMERA_COLOR.at(topics.CAMERA).key:
                message = delivery.parse()
                stamp = stamp_of(message)
                if not self.pictures or stamp - self.pictures[-1][0] >= PICTURE_EVERY:
                    self.pictures.append((stamp, message.data))


@dataclass(frozen=True)
class Trial:
    """A finished run."""

    case: Case
    scenario: Scenario
    score: Score
    reason: str
    """Why it ended, in words."""
    started: int
    """Stamp of the start [ns]."""
    errors: list[tuple[float, float]]
    """Time since the start [s] and mean node error of the true rope [m]."""
    trace: Trace

    @property
    def true_stiffness(self) -> float:
        """EI of the rope that the plant has, before its profile [N m^2]."""
        return bending_stiffness(self.scenario.plant_rope)

    @property
    def believed_stiffness(self) -> float:
        """EI that the controller began with [N m^2]."""
        return bending_stiffness(self.scenario.rope)

    @property
    def adapted_stiffness(self) -> tuple[float, float]:
        """EI that it ended with, and its standard deviation [N m^2]."""
        value, deviation = self.score.parameters["bending_stiffness"]
        return value, deviation


def bending_stiffness(rope) -> float:
    """EI of a scenario's rope [N m^2]."""
    return RodProperties(
        **{k: v for k, v in vars(rope).items() if k != "node_count"}
    ).bending_stiffness


def cases(beliefs: tuple[float, ...]) -> Iterator[Case]:
    """Rope and cable, all goals, every belief, with adaptation and without."""
    for rope, belief, goal, adapt in product(ROPES, beliefs, GOALS, (True, False)):
        yield Case(rope, goal, belief, adapt)


def scenario(
    case: Case, resolution: tuple[int, int], depth_noise: float, time_limit: float
) -> Scenario:
    """The case's scenario file with what is special to it."""
    path = SCENARIOS / f"{case.rope}.toml"
    true = load(path).plant_rope.youngs_modulus
    settings = (
        f"name={case.rope}-{case.goal}",
        f"goal.nodes=goals/{case.rope}-{case.goal}.csv",
        f"rope.youngs_modulus={case.belief * true}",
        f"control.adapt={'true' if case.adapt else 'false'}",
        f"sensing.resolution={list(resolution)}",
        f"sensing.depth_noise={depth_noise}",
        f"run.time_limit={time_limit}",
    )
    return load_with(path, settings)


def tried(case: Case, cell: Scenario, watch: Watch | None = None) -> Trial:
    """Runs a case."""
    trace = Trace()
    outcome = closed_loop.run(cell, stop_after=AFTERWARDS, watch=watch, taps=(trace,))
    started = outcome.scorer.started
    errors = [((stamp - started) / SECOND, mean) for stamp, mean, _ in outcome.scorer.errors]
    # Not the outcome itself: its stack holds cameras, rods and arms.
    return Trial(case, cell, outcome.score, outcome.reason, started, errors, trace)
