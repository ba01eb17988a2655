"""A rope that each of two cameras sees in part, or that only one of them still sees."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from lariat.perception.markers.marker_obstacles import ObstacleMove
from lariat.scenario import Scenario
from lariat.scenario.scenario import PLANT_EDGES
from services.perception.service import PerceptionService
from services.sim.service import SimService
from shared import topics
from shared.messages import NodeChain, chain
from shared.runtime.service import Inbox, Publication
from stack.simulation.simulated_time import START, SimulatedStack
from tests.services.perception.cell import ScriptedArms, scenario

SHELF = """
[[obstacles]]
name = "shelf"
shape = "box"
position = [0.0, 0.0, 0.55]
size = [0.14, 0.4, 0.01]
"""
OVERHEAD = """
[cameras.overhead]
position = [0.0, -0.05, 1.0]
"""
SIDE = """
[cameras.side]
position = [0.1, -0.75, 0.6]
look_at = [0.0, 0.0, 0.2]
"""


class Lab(SimService):
    """Sim whose side camera may be silent."""

    silent = False

    def step(self, inbox: Inbox, now: int) -> Iterator[Publication]:
        for publication in super().step(inbox, now):
            if not (self.silent and publication.topic.key.startswith("camera/side")):
                yield publication


class Cell:
    """Perception of a cell at rest, with what it says."""

    def __init__(self, of: Scenario) -> None:
        self.lab, self.perception = Lab(of), PerceptionService(of)
        self.seen: list[NodeChain] = []
        self.truth = np.zeros((0, 3))
        self.stack = SimulatedStack([ScriptedArms(of), self.lab, self.perception], [self._take])
        self.stack.warm_up()
        self._time = START

    def _take(self, delivery) -> None:
        if delivery.key == topics.ROPE_NODES.key:
            self.seen.append(delivery.parse())
        elif delivery.key == topics.ROPE_TRUTH.key:
            self.truth = chain(delivery.parse().positions)[::PLANT_EDGES]

    def run(self, seconds: float) -> None:
        self._time += round(seconds * 1e9)
        self.stack.advance_to(self._time)

    def error(self) -> float:
        """Root mean square node distance between the last perceived rope and the true one [m]."""
        gap = chain(self.seen[-1].positions) - self.truth
        return float(np.sqrt(np.mean(np.sum(gap**2, axis=1))))


@pytest.fixture(scope="module")
def both() -> Cell:
    cell = Cell(scenario(SHELF + OVERHEAD + SIDE))
    cell.run(0.4)
    return cell


def test_what_a_shelf_hides_from_one_camera_the_other_sees(both: Cell) -> None:
    alone = Cell(scenario(SHELF + OVERHEAD))
    alone.run(0.4)
    assert np.mean(alone.seen[-1].observed) < 0.8
    assert all(both.seen[-1].observed)
    assert both.error() < 1e-3
    assert max(both.seen[-1].sigma) < 0.5 * max(alone.seen[-1].sigma)


def test_two_cameras_of_one_instant_give_one_rope(both: Cell) -> None:
    stamps = [rope.stamp for rope in both.seen]
    assert len(set(stamps)) == len(stamps)
    assert np.median(np.diff(stamps)) == pytest.approx(33.3e6, rel=0.1)


class Watching:
    """Camera that sees the marker of the post somewhere, or does not."""

    def __init__(self, x: float, sees: bool = True) -> None:
        self._x, self.marked_in_view = x, frozenset({"post"} if sees else ())

    def follow_markers(self, obstacles: object) -> list[ObstacleMove]:
        return [ObstacleMove("post", (self._x, 0.3, 0.08), (1.0, 0.0, 0.0, 0.0))]


@pytest.mark.parametrize(("first_sees", "x"), [(True, 0.1), (False, 0.12)])
def test_a_marker_that_two_cameras_see_is_measured_by_the_first(first_sees: bool, x: float) -> None:
    perception = PerceptionService(scenario(OVERHEAD + SIDE))
    first, second = Watching(0.1, first_sees), Watching(0.12)
    perception._cameras[:] = [first, second]  # pyright: ignore[reportArgumentType]
    for camera in (first, second, first, second) if first_sees else (second,):
        perception._follow_markers(camera)  # pyright: ignore[reportArgumentType]
    (post,) = [o for o in perception._scene.obstacles if o.name == "post"]
    assert post.position[0] == x


def test_the_rope_is_seen_on_without_a_camera_that_falls_silent(both: Cell) -> None:
    both.lab.silent = True
    both.run(0.8)
    assert not any(rope.lost for rope in both.seen)
    assert "'side'" in both.perception.note
    assert np.mean(both.seen[-1].observed) < 0.8
    both.lab.silent = False
    both.run(0.2)
    assert both.perception.note == ""
    assert all(both.seen[-1].observed)
