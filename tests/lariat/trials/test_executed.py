"""What the arms really do keeps every bound, whatever the scene: speed, acceleration, distance."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lariat.trials.campaign import Order, one
from lariat.trials.scenes import Kind, draw
from shared.scenario import Scenario, load

BASE = load(Path(__file__).parents[3] / "scenarios" / "three-cylinders.toml")
KINDS: list[Kind] = ["hard", "boxes", "moving", "new-goal", "rotating"]


@pytest.fixture(scope="module")
def base() -> Scenario:
    return replace(
        BASE,
        rope=replace(BASE.rope, node_count=16),
        sensing=replace(BASE.sensing, source="truth"),
        run=replace(BASE.run, time_limit=2.5),
    )


@settings(max_examples=4, deadline=None, derandomize=True)
@given(st.sampled_from(KINDS), st.integers(0, 1000))
def test_executed_path_keeps_its_bounds(base: Scenario, kind: Kind, number: int) -> None:
    trial = one(Order(kind, number, 7, base))
    limits = base.limits
    assert trial.speed <= 1.0 + 1e-6
    assert trial.acceleration <= 1.02
    assert trial.apart <= limits.overstretch + 1e-3
    assert trial.gripper_clearance_mm >= 1e3 * limits.keep_out - 0.5
    assert trial.score.length_error_mm < 2.0
    assert not trial.touched
    # It did move.
    assert trial.speed > 0.1


def test_a_scene_is_the_same_for_the_same_number(base: Scenario, tmp_path: Path) -> None:
    one, same, other = (draw("boxes", k, 3, base, tmp_path) for k in (5, 5, 6))
    assert one == same
    assert one.nodes(one.goal) is not None
    assert one.obstacles != other.obstacles
