from __future__ import annotations

import math

import numpy as np
import pytest

from lariat.geometry import polylines
from lariat.scenario.cameras import DEFAULT_CAMERA
from lariat.trajectory import SECOND
from services.perception.service import PerceptionService
from shared import topics
from shared.messages import (
    NodeChain,
    Obstacle,
    Scene,
    SceneRequest,
    TaskState,
    chain,
    timestamp,
)
from stack.simulation.simulated_time import Delivery
from tests.services.perception.cell import Cell, scenario

COLOR = topics.CAMERA_COLOR.at(DEFAULT_CAMERA)
DEPTH = topics.CAMERA_DEPTH.at(DEFAULT_CAMERA)


def swing(time: float) -> tuple[np.ndarray, np.ndarray]:
    """Displacement [m] and velocity [m/s] of a swing of 0.1 m, from rest."""
    t = max(0.0, time - 0.2)
    y = 0.05 * (1.0 - math.cos(6.0 * t))
    return np.array([0.0, y, 0.0]), np.array([0.0, 0.3 * math.sin(6.0 * t), 0.0])


def requested(cell: Cell, **request) -> Scene:
    cell.stack.send(topics.SCENE_REQUEST, SceneRequest(**request))
    cell.run(0.1)
    return cell.has_subscribers[topics.SCENE_STATE.key][-1]


def test_nodes_of_a_moving_rope_are_within_a_millimetre_at_the_stamp_of_their_image() -> None:
    cell = Cell(scenario(), swing)
    cell.run(2.0)
    truth, seen = cell.truth(), cell.chains(topics.ROPE_NODES)
    assert len(seen) > 50
    errors = [
        np.linalg.norm(chain(m.positions) - truth[stamp], axis=1)
        for stamp, m in seen.items()
        if not m.lost
    ]
    assert len(errors) == len(seen)
    assert np.mean(errors) < 0.6e-3
    assert np.max(np.mean(errors, axis=1)) < 1.5e-3


def test_the_paper_baseline_errs_by_millimetres_to_centimetres() -> None:
    cell = Cell(scenario('method = "paper"\n'))
    cell.run(0.6)
    truth, seen = cell.truth(), cell.chains(topics.ROPE_NODES)
    errors = [
        np.linalg.norm(chain(m.positions) - truth[stamp], axis=1).mean()
        for stamp, m in seen.items()
        if not m.lost
    ]
    assert errors
    assert 2e-3 < np.median(errors) < 0.1


def test_truth_is_copied_without_camera_images() -> None:
    cell = Cell(scenario(source="truth"))
    cell.run(0.5)
    truth, seen = cell.truth(), cell.chains(topics.ROPE_NODES)
    assert len(seen) > 10
    assert COLOR.key not in cell.has_subscribers
    for stamp, m in seen.items():
        np.testing.assert_allclose(chain(m.positions), truth[stamp], atol=2e-5)
        assert min(m.sigma) > 0.0


def test_the_same_run_gives_the_same_bytes() -> None:
    def run() -> list[bytes]:
        cell = Cell(scenario(), swing)
        cell.run(0.5)
        return [
            m.SerializeToString(deterministic=True)
            for m in cell.has_subscribers[topics.ROPE_NODES.key]
        ]

    assert run() == run()


def test_the_scene_is_published_once_a_second_and_on_every_change() -> None:
    cell = Cell(scenario(source="truth"))
    cell.run(2.5)
    scenes = cell.has_subscribers[topics.SCENE_STATE.key]
    assert 2 <= len(scenes) <= 4
    assert {s.revision for s in scenes} == {1}
    assert [o.name for o in scenes[0].obstacles] == ["table", "post"]
    scene = requested(
        cell,
        id="a",
        action=SceneRequest.ADD,
        obstacle=Obstacle(name="ball", shape="sphere", position=[0.3, 0.3, 0.1], radius=0.04),
    )
    assert (scene.revision, scene.last_request, scene.refusal) == (2, "a", "")
    scene = requested(
        cell,
        id="b",
        action=SceneRequest.MOVE,
        obstacle=Obstacle(name="ball", position=[0.3, 0.2, 0.1]),
    )
    assert tuple(scene.obstacles[-1].position) == (0.3, 0.2, 0.1)
    scene = requested(cell, id="c", action=SceneRequest.REMOVE, obstacle=Obstacle(name="ball"))
    assert [o.name for o in scene.obstacles] == ["table", "post"]


@pytest.mark.parametrize(
    ("action", "obstacle", "reason"),
    [
        (SceneRequest.ADD, {"name": "x", "shape": "torus", "position": [0, 0, 0]}, "torus"),
        (SceneRequest.ADD, {"name": "x", "shape": "sphere", "radius": 0.1}, "position"),
        (
            SceneRequest.ADD,
            {"name": "x", "shape": "sphere", "position": [0.3, 0.3, 0.1]},
            "0 < radius",
        ),
        (
            SceneRequest.ADD,
            {"name": "x", "shape": "sphere", "position": [math.nan, 0, 0], "radius": 0.1},
            "not finite",
        ),
        (
            SceneRequest.ADD,
            {"name": "post", "shape": "sphere", "position": [0.3, 0.3, 0.1], "radius": 0.02},
            "already",
        ),
        (
            SceneRequest.ADD,
            {"name": "x", "shape": "sphere", "position": [0.0, 0.0, 0.24], "radius": 0.1},
            "overlap the rope",
        ),
        (SceneRequest.MOVE, {"name": "nobody", "position": [0, 0, 0]}, "nobody"),
        (SceneRequest.MOVE, {"name": "post", "position": [0, 0]}, "3 numbers"),
        (SceneRequest.REMOVE, {"name": "nobody"}, "there are: post, table"),
    ],
)
def test_invalid_scene_requests_are_refused_with_their_reason(
    action: int, obstacle: dict, reason: str
) -> None:
    cell = Cell(scenario(source="truth"))
    cell.run(0.2)
    scene = requested(cell, id="r", action=action, obstacle=Obstacle(**obstacle))
    assert scene.last_request == "r"
    assert reason in scene.refusal
    assert scene.revision == 1


def test_an_event_moves_an_obstacle_at_its_time_and_a_reset_undoes_it() -> None:
    event = '[[events]]\ntime = 0.5\nmove_obstacle = "post"\nposition = [0.1, 0.3, 0.08]\n'
    cell = Cell(scenario(event, source="truth"))
    cell.run(0.2)
    started = cell.time
    cell.stack.send(topics.TASK_STATE, TaskState(stamp=started, run_started=started, reset_count=4))
    cell.run(0.45)
    assert cell.has_subscribers[topics.SCENE_STATE.key][-1].revision == 1
    cell.run(0.1)
    moved = cell.has_subscribers[topics.SCENE_STATE.key][-1]
    assert tuple(moved.obstacles[1].position) == (0.1, 0.3, 0.08)
    # A controller that replaces another one knows no count at first.
    for count in (0, 4):
        cell.stack.send(topics.TASK_STATE, TaskState(stamp=cell.time, reset_count=count))
        cell.run(0.1)
    still = cell.has_subscribers[topics.SCENE_STATE.key][-1]
    assert tuple(still.obstacles[1].position) == (0.1, 0.3, 0.08)
    cell.stack.send(topics.TASK_STATE, TaskState(stamp=cell.time, reset_count=5))
    cell.run(0.1)
    back = cell.has_subscribers[topics.SCENE_STATE.key][-1]
    assert tuple(back.obstacles[1].position) == (0.0, 0.2, 0.08)
    assert back.revision == 3


def test_a_silent_camera_is_reported() -> None:
    cell = Cell(scenario("outside = true\n"))
    cell.run(1.0)
    seen: list[NodeChain] = cell.has_subscribers[topics.ROPE_NODES.key]
    assert all("no frame" in m.lost and "'overhead'" in m.lost for m in seen)
    assert len(seen) >= 2


def test_a_frozen_camera_is_reported() -> None:
    cell = Cell(scenario())
    cell.run(0.2)
    color, depth = cell.has_subscribers[COLOR.key][-1], cell.has_subscribers[DEPTH.key][-1]
    frozen = Cell(scenario("outside = true\n"))
    frozen.run(0.1)
    frozen.stack.send(
        topics.CAMERA_CALIBRATION.at(DEFAULT_CAMERA),
        cell.has_subscribers[topics.CAMERA_CALIBRATION.at(DEFAULT_CAMERA).key][0],
    )
    for _ in range(12):
        for topic, message in ((COLOR, color), (DEPTH, depth)):
            message.timestamp.CopyFrom(timestamp(frozen.time))
            frozen.stack.send(topic, message)
        frozen.run(0.033)
    seen: list[NodeChain] = frozen.has_subscribers[topics.ROPE_NODES.key]
    assert seen[0].lost == ""
    assert "frozen" in seen[-1].lost


def test_a_missing_calibration_is_reported_after_two_seconds() -> None:
    cell = Cell(scenario())
    cell.run(2.3)
    color, depth = (cell.has_subscribers[topic.key] for topic in (COLOR, DEPTH))
    uncalibrated = Cell(scenario("outside = true\n"))
    published = []
    for messages in zip(color, depth, strict=False):
        for topic, message in zip((COLOR, DEPTH), messages, strict=True):
            uncalibrated.stack.send(topic, message)
        uncalibrated.run(0.033)
        published.append(topics.ROPE_NODES.key in uncalibrated.has_subscribers)
    assert not any(published[:58])
    lost = uncalibrated.has_subscribers[topics.ROPE_NODES.key][-1].lost
    assert "calibration" in lost
    assert "'overhead'" in lost


@pytest.mark.parametrize(("color", "diameter"), [([255, 255, 255], 0.008), ([90, 20, 30], 0.006)])
def test_another_rope_is_published_where_it_is_and_only_where_there_is_one(
    color: list[int], diameter: float
) -> None:
    points = [[0.05, -0.15, 0.26], [0.05, 0.15, 0.28]]
    other = f"\n[[distractors]]\npoints = {points}\ncolor = {color}\ndiameter = {diameter}\n"
    alone, beside = Cell(scenario()), Cell(scenario(other))
    for cell in (alone, beside):
        cell.run(0.5)
    silent = alone.has_subscribers[topics.ROPE_OTHERS.key]
    assert len(silent) <= 2
    assert not any(message.ropes for message in silent)
    newest = beside.has_subscribers[topics.ROPE_OTHERS.key][-1]
    (rope,) = newest.ropes
    assert rope.diameter == pytest.approx(diameter, rel=0.25)
    found = np.concatenate([chain(line.positions) for line in rope.lines])
    axis = polylines.resample(np.array(points), 200)
    gaps = polylines.point_distances(axis, found)
    assert np.max(np.min(gaps, axis=0)) < 0.006
    assert np.mean(np.min(gaps, axis=1) < 0.01) > 0.8
    errors = [
        np.linalg.norm(chain(m.positions) - beside.truth()[stamp], axis=1).mean()
        for stamp, m in beside.chains(topics.ROPE_NODES).items()
        if not m.lost
    ]
    assert np.mean(errors) < 1e-3


def test_other_ropes_are_searched_in_a_step_of_their_own() -> None:
    points = [[0.05, -0.15, 0.26], [0.05, 0.15, 0.28]]
    cell = Cell(scenario(f"\n[[distractors]]\npoints = {points}\ndiameter = 0.008\n"))
    published: dict[str, dict[int, int]] = {}

    def note(delivery: Delivery) -> None:
        if delivery.key in (topics.ROPE_NODES.key, topics.ROPE_OTHERS.key):
            times = published.setdefault(delivery.key, {})
            times[delivery.parse().stamp] = delivery.published

    cell.stack.taps.append(note)
    cell.run(0.5)
    ropes, others = (published[t.key] for t in (topics.ROPE_NODES, topics.ROPE_OTHERS))
    assert len(others) > 3
    for stamp, time in others.items():
        assert time - ropes[stamp] == pytest.approx(SECOND / PerceptionService.rate, abs=1)
        assert time not in ropes.values()


def test_images_that_cannot_be_handled_are_refused_and_the_next_ones_are_seen(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    cell = Cell(scenario())
    (service,) = (s.service for s in cell.stack._scheduled if s.service.name == "perception")
    assert isinstance(service, PerceptionService)
    service.door.strict = False

    def fail(*_: object) -> None:
        raise ZeroDivisionError

    with monkeypatch.context() as patch:
        patch.setattr("services.perception.service.fuse", fail)
        cell.run(0.3)
    assert service.door.refused > 3
    assert not cell.chains(topics.ROPE_NODES)
    cell.run(0.3)
    assert cell.chains(topics.ROPE_NODES)
