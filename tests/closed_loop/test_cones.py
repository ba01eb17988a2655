"""Cones in the way, seen by the camera, with MuJoCo's rope as the true one."""

from __future__ import annotations

from lariat.scenario.settings import load_with
from stack.simulation import closed_loop
from tests.closed_loop.loop import SCENARIOS

CONES = (
    'obstacles=[{name="left", shape="cone", position=[-0.06, 0.06, 0.2], radius=0.05, height=0.3}, '
    '{name="right", shape="cone", position=[0.1, -0.02, 0.2], radius=0.05, height=0.3}]'
)


def test_rope_reaches_its_goal_past_two_cones() -> None:
    cell = load_with(SCENARIOS / "three-cylinders.toml", [CONES, 'plant.model="mujoco"'])
    score = closed_loop.run(cell, stop_after=0.2).score
    assert score.reached
    assert score.final_error_mm is not None
    assert score.final_error_mm < 0.5
    assert score.min_clearance_mm is not None
    assert score.min_clearance_mm > 7.0
