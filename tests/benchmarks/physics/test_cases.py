"""The rod against closed forms, frequencies, critical loads and balances with known values."""

from __future__ import annotations

import math

import numpy as np
import pytest

from benchmarks.physics import buckling, closed_forms, frequencies, writhing
from benchmarks.physics.cases import Case

CASES: tuple[Case, ...] = (
    *closed_forms.CASES,
    *frequencies.CASES,
    *buckling.CASES,
    writhing.CASES[0],
)
"""Cases that take little time."""


@pytest.mark.parametrize(
    ("case", "node_count"),
    [
        pytest.param(case, min(case.bounds), id=f"{case.name} n={min(case.bounds)}")
        for case in CASES
    ],
)
def test_the_rod_is_within_the_bound(case: Case, node_count: int) -> None:
    assert case.error(node_count) <= case.bounds[node_count]


@pytest.mark.parametrize(
    "case", [*frequencies.CASES[:1], *buckling.CASES[:1]], ids=lambda case: case.name
)
def test_clamped_beams_converge_with_second_order(case: Case) -> None:
    coarse, fine = case.error(20), case.error(80)
    assert math.log(coarse / fine) / math.log(79.0 / 19.0) > 1.8


def test_wave_numbers_solve_the_frequency_equations() -> None:
    for name, sign in (("clamped", 1.0), ("cantilever", -1.0)):
        for mode, tabulated in ((1, 4.730041), (2, 7.853205)) if sign > 0 else ((1, 1.875104),):
            assert frequencies.BEAMS[name].wave_number(mode) == pytest.approx(tabulated, abs=1e-6)


def test_work_of_the_grips_is_the_energy_of_the_loop() -> None:
    energies, works, _ = writhing.smooth_closing(60)
    assert works[-1] < -0.05 * energies[0]
    assert np.max(np.abs(energies - energies[0] - works)) < 1e-3 * -works[-1]


def test_twist_and_writhe_of_a_loop_are_the_turns_of_its_grips() -> None:
    _, _, state = writhing.smooth_closing(60)
    assert writhing.writhe(state.positions) > 0.3
    total = writhing.twist(state) + writhing.writhe(state.positions)
    assert total == pytest.approx(writhing.LOOP_TURNS, abs=1e-3)


def test_writhe_changes_its_sign_in_the_mirror() -> None:
    _, _, state = writhing.smooth_closing(60)
    mirrored = state.positions * np.array([1.0, -1.0, 1.0])
    assert writhing.writhe(mirrored) == pytest.approx(-writhing.writhe(state.positions))


def test_a_case_is_held_by_errors_and_order_together() -> None:
    first_order = [0.1, 0.05, 0.025]

    def case(bound: float, order: float) -> Case:
        return Case("", "-", lambda n: 1.0 / (n - 1), (11, 21, 41), {41: bound}, order)

    assert case(0.1, 0.9).errors() == pytest.approx(first_order)
    assert case(0.1, 0.9).order(first_order) == pytest.approx(1.0)
    assert case(0.1, 0.9).held(first_order)
    assert not case(0.1, 1.8).held(first_order)
    assert not case(0.01, 0.9).held(first_order)
