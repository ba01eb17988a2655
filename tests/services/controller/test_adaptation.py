"""Adaptation finds the stiffness, and knows how well."""

from __future__ import annotations

import pytest

from tests.services.controller.cell import PROPERTIES, Cell, grips

GOAL = grips((-0.14, 0.05, 0.27), (0.16, 0.02, 0.31))


@pytest.mark.parametrize(("factor", "noise"), [(0.4, 0.0), (3.0, 2e-3)])
def test_stiffness_is_found_within_what_is_claimed(factor: float, noise: float) -> None:
    cell = Cell(stiffness_factor=factor, noise=noise, adapts=True)
    goal = cell.plant.rest(*GOAL).state.positions
    cell.follow()
    cell.run(4.0, goal)
    true = factor * PROPERTIES.bending_stiffness
    found, deviation = cell.adaptation.bending_stiffness, cell.adaptation.standard_deviation
    assert deviation < 0.3 * found
    assert abs(found - true) < max(3.0 * deviation, 0.15 * true)
    assert cell.error(goal) < 2.5e-3


def test_model_with_the_found_stiffness_needs_no_offset() -> None:
    offsets = []
    for adapts in (False, True):
        cell = Cell(stiffness_factor=4.0, adapts=adapts)
        goal = cell.plant.rest(*GOAL).state.positions
        cell.follow()
        cell.run(3.0, goal)
        offsets.append(abs(cell.estimate.offset).mean())
    assert offsets[1] < 0.2 * offsets[0]
