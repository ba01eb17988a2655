"""Time that the gateway's tick takes with the longest chunks: `lariat bench faults chunks`.

Processor time of a step, without that of the emulated arms, which step in the same process. Every
tick holds a new chunk; a controller sends one at every second or third.
"""

from __future__ import annotations

import gc
import time
from collections.abc import Iterator
from typing import Any

import numpy as np

from benchmarks.tables import PRINT_DEFAULTS, Flat, PrintOptions, Result
from lariat.geometry.obstacles import Obstacle
from lariat.scenario import SIDES, Scenario, load
from lariat.scenario.shipped import find
from lariat.trajectory import SECOND
from services.robot_gateway import service as gateway
from services.robot_gateway.service import RobotGatewayService
from shared import topics
from shared.messages import (
    ArmSetpoints,
    ArmStates,
    Scene,
    Setpoints,
    obstacle_message,
    poses_known,
)
from shared.runtime.service import Inbox, Received
from stack.simulation.emulated_arms import MemoryLink, emulated_links
from stack.simulation.simulated_time import START

PERIOD = SECOND // 125
"""Period of the gateway [ns]."""
CHUNKS: dict[str, tuple[int, int, int]] = {
    "usual": (26, 20_000_000, 1),
    "longest": (40, 50_000_000, 1),
    "two, one refused": (40, 50_000_000, 2),
}
"""Number of poses, time between two of them [ns], and chunks in a tick, by name."""
LIFT = 0.03
"""Height by which the grips are lifted and lowered in turn [m]."""
START_TIME = 5 * SECOND
"""Longest time until the arms are ready [ns]."""
WARM_UP_TICKS = 75
"""Ticks with chunks before the first one that counts."""


class TimedLink(MemoryLink):
    """Link to an emulated arm that measures the processor time of the arm."""

    def __init__(self, link: MemoryLink) -> None:
        super().__init__(link.emulator)
        self.seconds = 0.0
        """Processor time of the arm so far [s]."""

    def advance(self, now: int) -> None:
        """Advance the arm to the time of a step [ns]."""
        begun = time.thread_time()
        super().advance(now)
        self.seconds += time.thread_time() - begun


class GatewayCell:
    """Gateway with emulated arms, and a writer of its setpoints."""

    def __init__(self, scenario: Scenario, obstacle_count: int) -> None:
        """Create a gateway that is armed, and give it a scene."""
        links = emulated_links(scenario, START)
        self.links = {side: TimedLink(link) for side, link in links.items()}
        self.gateway: RobotGatewayService = gateway.build(scenario, "g", links=dict(self.links))
        self.now, self._sequence = START, 0
        bodies = [*scenario.bodies, *_clutter(obstacle_count)]
        self.obstacle_count = len(bodies)
        scene = Scene(revision=1, obstacles=[obstacle_message(body) for body in bodies])
        state = self.step([scene])[0]
        while not (poses_known(state) and state.may_move) and self.now < START + START_TIME:
            state = self.step([])[0]
        self._grips = [self.gateway.cell.arms.grips[k].position.copy() for k in (0, 1)]
        # Arms that are armed take a moment to become ready; meanwhile no chunk is looked at.
        for _ in range(WARM_UP_TICKS):
            self.step([self.chunk(*CHUNKS["usual"][:2])])

    def step(self, messages: list[Scene | Setpoints]) -> tuple[ArmStates, float]:
        """Step the gateway with messages; return its state and the processor time [s]."""
        self.now += PERIOD
        arrived: dict[str, list[Received]] = {}
        for message in messages:
            topic = topics.SCENE_STATE if isinstance(message, Scene) else topics.ARM_SETPOINTS
            item = Received(message, "controller-0", 0, self.now)
            arrived.setdefault(topic.key, []).append(item)
        inbox = Inbox({key: items[-1] for key, items in arrived.items()}, arrived)
        arms = sum(link.seconds for link in self.links.values())
        begun = time.thread_time()
        ((_, state),) = self.gateway.step(inbox, self.now)
        spent = time.thread_time() - begun
        assert isinstance(state, ArmStates)
        return state, spent - (sum(link.seconds for link in self.links.values()) - arms)

    def chunk(self, count: int, dt: int, refused: bool = False) -> Setpoints:
        """Return a chunk of poses, `dt` ns apart, that lifts or lowers the driven grips.

        It begins where their command is; the end of a refused one lies outside of the workspace.
        """
        self._sequence += 1
        follower = self.gateway.cell.follower
        share = np.clip(np.arange(count) / (count - 3), 0.0, 1.0)[:, None]
        smooth = share**3 * (10.0 - 15.0 * share + 6.0 * share**2)
        up = (self.now // (2 * SECOND)) % 2
        arms = []
        for row, end in enumerate(follower.driven):
            begin = follower.state.positions[row]
            goal = self._grips[end] + [0.0, 0.0, LIFT * up]
            points = begin + smooth * (goal - begin)
            if refused:
                points[-1] += 50.0
            turns = np.tile(follower.state.orientations[row], (count, 1))
            arms.append(
                ArmSetpoints(
                    arm=SIDES[end],
                    positions=points.ravel().tolist(),
                    orientations=turns.ravel().tolist(),
                )
            )
        return Setpoints(
            session="writer", sequence=self._sequence, t0=self.now + PERIOD, dt=dt, arms=arms
        )


def run(
    scenarios: tuple[str, ...] = ("three-cylinders", "fixed-end", "two-arms"),
    obstacles: tuple[int, ...] = (0, 64, 250),
    ticks: int = 250,
    options: Flat[PrintOptions] = PRINT_DEFAULTS,
) -> int:
    """Measure the gateway's ticks with long chunks, in scenes full of obstacles.

    The added obstacles are small boxes between and around the grips, so that the rope's path has to
    be searched among them; most chunks are then refused, which is what is measured too.

    Examples:
      lariat bench faults chunks
      lariat bench faults chunks --scenarios two-arms --obstacles 0 --ticks 1000

    Args:
        scenarios: Names of shipped scenarios.
        obstacles: Numbers of obstacles that are added to the scenario's own.
        ticks: Number of ticks of each measurement.

    Returns:
        0 when no tick took longer than its period, 1 otherwise.
    """
    rows = [row for name in scenarios for row in _measured(name, obstacles, ticks)]
    words = f"processor time of a tick; its period is {1e-6 * PERIOD:g} ms"
    options.publish(Result("ticks", rows, words))
    return 0 if all(row["max_ms"] <= 1e-6 * PERIOD for row in rows) else 1


def _measured(name: str, obstacles: tuple[int, ...], ticks: int) -> Iterator[dict[str, Any]]:
    """Yield processor times of ticks by number of obstacles and kind of chunks."""
    scenario = load(find(name))
    for added in obstacles:
        for kind, (count, dt, chunks) in CHUNKS.items():
            cell = GatewayCell(scenario, added)
            gc.collect()
            gc.disable()
            times, followed = [], set[int]()
            former = cell.step([])[0].sequence
            for _ in range(ticks):
                messages = [cell.chunk(count, dt, refused=k > 0) for k in range(chunks)]
                state, spent = cell.step([*messages])
                times.append(1e3 * spent)
                followed.add(state.sequence)
            gc.enable()
            cell.gateway.close()
            p50, p99 = np.percentile(times, (50, 99))
            yield {
                "scenario": name,
                "chunk": kind,
                "obstacles": cell.obstacle_count,
                "followed": len(followed - {former}),
                "p50_ms": round(float(p50), 2),
                "p99_ms": round(float(p99), 2),
                "max_ms": round(max(times), 2),
            }


def _clutter(count: int) -> list[Obstacle]:
    """Return small boxes between and around the grips."""
    rng = np.random.default_rng(0)
    low, high = np.array([-0.12, -0.3, 0.05]), np.array([0.12, 0.3, 0.5])
    return [
        Obstacle("box", tuple(rng.uniform(low, high)), size=(0.02, 0.02, 0.02), name=f"box-{k}")
        for k in range(count)
    ]
