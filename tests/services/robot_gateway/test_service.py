"""Gateway service: scenes that are no scenes do not switch a rule off."""

from __future__ import annotations

from pathlib import Path

import pytest

from services.robot_gateway.service import RobotGatewayService, build
from shared import topics
from shared.messages import ArmSetpoints, ArmStates, Obstacle, Scene, Setpoints
from shared.scenario import SIDES, load
from shared.service import Inbox, Received

SCENARIO = load(Path(__file__).parents[3] / "scenarios" / "three-cylinders.toml")
NAN = float("nan")
START = 1_000_000_000


@pytest.fixture
def gateway() -> RobotGatewayService:
    return build(SCENARIO, "gateway-0")


def step_with(gateway: RobotGatewayService, scene: Scene) -> set[str]:
    """Names of the obstacles that the gateway keeps away from after a scene."""
    received = Received(scene, "stranger", 0, 0)
    key = topics.SCENE_STATE.key
    list(gateway.step(Inbox({key: received}, {key: [received]}), 1_000_000_000))
    return {o.name for o in gateway.cell.follower.constraints.collision.scene.obstacles}


def test_empty_scene_keeps_the_scenarios_bodies(gateway: RobotGatewayService) -> None:
    assert step_with(gateway, Scene(revision=99)) == {"table", "low", "middle", "high"}


@pytest.mark.parametrize(
    "obstacle",
    [
        Obstacle(name="far", shape="sphere", position=[NAN, 9.0, 9.0], radius=0.1),
        Obstacle(name="far", shape="cone", position=[9.0, 9.0, 9.0]),
        Obstacle(name="far", shape="sphere", position=[9.0], radius=0.1),
    ],
    ids=["not finite", "unknown shape", "wrong length"],
)
def test_scene_with_garbage_is_refused_and_logged(
    gateway: RobotGatewayService, obstacle: Obstacle, caplog: pytest.LogCaptureFixture
) -> None:
    names = step_with(gateway, Scene(revision=99, obstacles=[obstacle]))
    assert names == {"table", "low", "middle", "high"}
    assert "scene 99 refused" in caplog.text


def setpoints(sequence: int, count: int, dt: int = 20_000_000, hold: bool = False) -> Received:
    """Setpoints of a writer that stays where it is."""
    starts = SCENARIO.grips(SCENARIO.start)
    arms = [
        ArmSetpoints(
            arm=side,
            positions=count * start.position.tolist(),
            orientations=count * start.orientation.tolist(),
        )
        for side, start in zip(SIDES, starts, strict=True)
    ]
    message = Setpoints(session="writer", sequence=sequence, t0=START, dt=dt, arms=arms, hold=hold)
    return Received(message, "controller-0", sequence, START)


def step_with_setpoints(gateway: RobotGatewayService, *arrived: Received) -> ArmStates:
    for tick in range(8, 0, -1):  # The cell arms itself.
        list(gateway.step(Inbox({}, {}), START - tick * 8_000_000))
    ((_, state),) = gateway.step(Inbox({}, {topics.ARM_SETPOINTS.key: arrived}), START)
    return state


@pytest.mark.parametrize(("count", "dt"), [(2000, 2_000_000), (65, 10_000_000), (16, 200_000_000)])
def test_chunk_that_takes_too_long_to_check_is_refused(
    gateway: RobotGatewayService, count: int, dt: int
) -> None:
    state = step_with_setpoints(gateway, setpoints(1, count, dt))
    assert state.refused_sequence == 1
    assert "finite" in state.refusal


def test_longest_chunk_is_followed(gateway: RobotGatewayService) -> None:
    assert step_with_setpoints(gateway, setpoints(1, 64)).refused_sequence == 0


def test_only_the_newest_chunk_of_a_tick_is_checked(
    gateway: RobotGatewayService, monkeypatch: pytest.MonkeyPatch
) -> None:
    checked = []
    check = gateway.cell.follower.check
    monkeypatch.setattr(
        gateway.cell.follower, "check", lambda chunk, *_: checked.append(chunk) or check(chunk, *_)
    )
    state = step_with_setpoints(gateway, *(setpoints(k, 20) for k in range(512)))
    assert len(checked) == 1
    assert state.sequence == 511


def test_hold_counts_beside_newer_chunks(gateway: RobotGatewayService) -> None:
    state = step_with_setpoints(gateway, setpoints(1, 0, hold=True), setpoints(0, 20))
    assert state.sequence == 1
