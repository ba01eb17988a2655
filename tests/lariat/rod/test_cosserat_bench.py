"""The rod in a neutral suite: experiments and metrics of cosseratbench."""

from __future__ import annotations

import pytest
from cosseratbench.experiment import COMPLETED, UNSUPPORTED, Result, run
from cosseratbench.registry import load_experiment, load_solver

from lariat.rod.cosserat_bench import LariatRod


def judged(name: str, **values: float) -> Result:
    return run(load_experiment(name), LariatRod(), values=values)


def test_the_suite_finds_the_rod() -> None:
    assert isinstance(load_solver("lariat", time_step_scale=0.5), LariatRod)


def test_a_cable_between_two_pins_is_an_elastic_catenary() -> None:
    result = judged("catenary")
    assert result.outcome == COMPLETED
    assert result.metrics["shape_error"] < 1e-3
    assert result.metrics["sag_error"] < 5e-4


def test_a_cable_that_hangs_from_a_pin_swings_as_in_theory() -> None:
    result = judged("pendulum")
    assert result.metrics["period_error"] < 3e-4
    assert abs(result.metrics["amplitude_change"]) < 1e-4


@pytest.mark.parametrize(("overhang", "slides"), [(0.95, False), (1.1, True)])
def test_friction_holds_a_rope_over_a_cylinder_up_to_the_exact_overhang(
    overhang: float, slides: bool
) -> None:
    slide = judged("capstan", overhang=overhang).metrics["slide"]
    assert slide > 0.1 if slides else slide < 5e-3


@pytest.mark.parametrize("name", ["cantilever", "crossing", "twist"])
def test_what_the_rod_has_not_is_said(name: str) -> None:
    result = judged(name)
    assert result.outcome == UNSUPPORTED
    assert result.missing
