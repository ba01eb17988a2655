"""Gateway service: scenes that are no scenes do not switch a rule off."""

from __future__ import annotations

from pathlib import Path

import pytest

from services.robot_gateway.service import RobotGatewayService, build
from shared import topics
from shared.messages import Obstacle, Scene
from shared.scenario import load
from shared.service import Inbox, Received

SCENARIO = load(Path(__file__).parents[3] / "scenarios" / "three-cylinders.toml")
NAN = float("nan")


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
