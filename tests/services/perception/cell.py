"""Simulated cell with the services sim and perception, and scripted arms."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
from jaxtyping import Float64

from lariat.scenario import Scenario, parse
from lariat.scenario.scenario import PLANT_EDGES
from lariat.trajectory import SECOND
from services.perception.service import PerceptionService
from services.sim.service import SimService
from shared import topics
from shared.messages import ArmState, ArmStates, NodeChain, chain
from shared.runtime.service import Inbox, Publication
from stack.simulation.simulated_time import START, SimulatedStack

TEXT = """
name = "seen"
seed = 4
[rope]
length = 0.45
diameter = 0.008
node_count = 30
[plant]
model = "mujoco"
[start]
line = [[-0.18, 0.0, 0.30], [0.18, 0.0, 0.30]]
[goal]
line = [[-0.17, 0.15, 0.22], [0.17, 0.15, 0.24]]
[[obstacles]]
name = "post"
shape = "cylinder"
position = [0.0, 0.2, 0.08]
radius = 0.03
height = 0.16
[sensing]
source = "camera"
"""

Motion = Callable[[float], tuple[np.ndarray, np.ndarray]]


def scenario(extra: str = "", source: str = "camera", model: str = "mujoco") -> Scenario:
    """Scenario of the cell, with `extra` appended to its text."""
    text = TEXT.replace('source = "camera"', f'source = "{source}"')
    return parse(text.replace('model = "mujoco"', f'model = "{model}"') + extra, Path())


def still(time: float) -> tuple[np.ndarray, np.ndarray]:
    """Displacement [m] and velocity [m/s] of grips at rest."""
    return np.zeros(3), np.zeros(3)


class ScriptedArms:
    """Publishes `arm/state`: both grips move alike."""

    name = "robot_gateway"
    reads = ()
    writes = (topics.ARM_STATE,)
    rate = 125.0
    latency = 0.002

    def __init__(self, scenario: Scenario, motion: Motion = still) -> None:
        self._start = scenario.grips(scenario.start)
        self._motion = motion
        self.reset_count = 1

    def warm_up(self) -> None:
        """Do nothing: nothing is compiled."""

    def step(self, inbox: Inbox, now: int) -> Iterator[Publication]:
        """Publish one state of both arms."""
        shift, speed = self._motion((now - START) / SECOND)
        yield Publication(
            topics.ARM_STATE,
            ArmStates(
                stamp=now,
                boot="scripted",
                reset_count=self.reset_count,
                arms=[
                    ArmState(
                        arm=arm,
                        driver="ideal",
                        position=pose.position + shift,
                        orientation=pose.orientation,
                        linear_velocity=speed,
                        angular_velocity=np.zeros(3),
                    )
                    for arm, pose in zip(("left", "right"), self._start, strict=True)
                ],
            ),
        )


class Cell:
    """Stack of the cell, and all messages published on it."""

    def __init__(self, of: Scenario, motion: Motion = still) -> None:
        self.arms = ScriptedArms(of, motion)
        self.has_subscribers: dict[str, list] = {}
        self.stack = SimulatedStack(
            [self.arms, SimService(of), PerceptionService(of)],
            taps=[lambda d: self.has_subscribers.setdefault(d.key, []).append(d.parse())],
        )
        self.stack.warm_up()

    def run(self, seconds: float) -> None:
        """Advance the simulated time [s]."""
        self.time = getattr(self, "time", START) + round(seconds * SECOND)
        self.stack.advance_to(self.time)

    def chains(self, topic: topics.Topic) -> dict[int, NodeChain]:
        """Node chains published on a topic, by stamp."""
        return {m.stamp: m for m in self.has_subscribers.get(topic.key, [])}

    def truth(self) -> dict[int, Float64[np.ndarray, "n 3"]]:
        """True nodes by stamp, as many as are perceived [m]."""
        chains = self.chains(topics.ROPE_TRUTH)
        return {stamp: chain(m.positions)[::PLANT_EDGES] for stamp, m in chains.items()}
