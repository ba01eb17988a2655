"""Ends that change places without rotating: a loop of the rope becomes a turn of twist."""

from __future__ import annotations

from lariat.scenario.settings import load_with
from stack.simulation import closed_loop
from tests.closed_loop.loop import SCENARIOS

SETTINGS = (
    "obstacles=[]",
    "start.line=[[-0.15, 0.0, 0.35], [0.15, 0.0, 0.35]]",
    "goal.line=[[-0.05, 0.2, 0.35], [-0.25, 0.2, 0.30]]",
    "plant.model=links",
    'sensing.source="truth"',
)


def test_ends_change_places_without_rotating() -> None:
    scenario = load_with(SCENARIOS / "three-cylinders.toml", SETTINGS)
    outcome = closed_loop.run(scenario, stop_after=0.5)
    assert outcome.score.reached, outcome.reason
    assert outcome.score.replans == 0
    assert outcome.score.final_error_mm is not None
    assert outcome.score.final_error_mm < 2.0
