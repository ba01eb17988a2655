"""Goal for a part of the rope, with a rope that is stiffer than the model."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from lariat.geometry import polylines
from lariat.scenario import Scenario, load
from lariat.scenario.settings import load_with
from lariat.simulation.rest_shape import rest_shape
from shared import topics
from shared.messages import chain
from stack.simulation import closed_loop

SCENARIOS = Path(__file__).parents[2] / "scenarios"
PART = (0.12, 0.3)
"""Distances of the part's ends from the left grip [m]."""


@pytest.fixture
def cell(tmp_path: Path) -> Scenario:
    """Three cylinders; the goal is a part of what the true rope takes between hidden grips."""
    true = ("plant.model=rod", "plant.rope.youngs_modulus=2e6", 'sensing.source="truth"')
    stiff = load_with(SCENARIOS / "three-cylinders.toml", true)
    dense = polylines.resample_smooth(rest_shape(stiff), 600)
    np.savetxt(tmp_path / "part.csv", dense[polylines.within(dense, *PART)], delimiter=",")
    text = (SCENARIOS / "three-cylinders.toml").read_text()
    line = next(row for row in text.splitlines() if row.startswith("line = [[-0.17"))
    path = tmp_path / "cell.toml"
    path.write_text(text.replace(line, f'nodes = "part.csv"\npart = {list(PART)}'))
    return load_with(path, true)


def test_part_is_met_though_the_rope_is_twice_as_stiff(cell: Scenario) -> None:
    outcome = closed_loop.run(cell, stop_after=0.5)
    score = outcome.score
    assert score.reached, outcome.reason
    assert score.final_error_mm is not None
    assert score.final_error_mm < 1.0
    assert score.min_clearance_mm is not None
    assert score.min_clearance_mm > 8.0
    state = outcome.stack.latest(topics.TASK_STATE)
    assert state is not None
    assert list(state.goal.part) == list(PART)
    # What the controller says is the error of the part; the free rest has another one.
    assert 1e3 * state.error == pytest.approx(score.final_error_mm, abs=0.1)
    rope = outcome.stack.latest(topics.ROPE_TRUTH)
    assert rope is not None
    goal = chain(state.goal.positions)
    nodes = polylines.resample_smooth(chain(rope.positions), len(goal))
    assert abs(polylines.mean_node_distance(nodes, goal) - state.error) > 2e-4


def test_part_of_a_rope_at_rest_counts_alone() -> None:
    settings = ("plant.model=rod", 'sensing.source="truth"', f"goal.part={list(PART)}")
    cell = load_with(SCENARIOS / "three-cylinders.toml", settings)
    outcome = closed_loop.run(cell, stop_after=0.2)
    assert outcome.score.reached, outcome.reason
    state = outcome.stack.latest(topics.TASK_STATE)
    assert state is not None
    assert list(state.goal.part) == list(PART)
    whole = rest_shape(cell)
    wanted = chain(state.goal.positions)
    assert (
        polylines.mean_node_distance(polylines.resample_smooth(whole, len(wanted)), wanted) < 1e-3
    )


def test_shape_that_the_rope_does_not_take_is_refused(cell: Scenario) -> None:
    # A ring lies in a plane of its own; a rope whose ends do not rotate does not close one.
    radius = (PART[1] - PART[0]) / (2.0 * np.pi)
    angles = np.linspace(0.0, 2.0 * np.pi, 200)
    ring = np.stack([radius * np.cos(angles), 0.15 + radius * np.sin(angles), 0.2 + 0.0 * angles])
    np.savetxt(cell.folder / "part.csv", ring.T, delimiter=",")
    with pytest.raises(ValueError, match="at rest"):
        closed_loop.run(load(cell.folder / "cell.toml"))
