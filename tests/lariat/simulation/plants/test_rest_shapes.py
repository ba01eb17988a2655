"""Rest shapes of all plants against the continuum, a boundary value problem."""

from __future__ import annotations

from dataclasses import replace
from typing import get_args

import numpy as np
import pytest

from benchmarks.physics.hanging import BASE, Model, build_plant, level_grip, plant_error

PITCHED = replace(
    BASE.stiffer(2.0), left=level_grip(-0.12, pitch=22.9), right=level_grip(0.12, pitch=17.2)
)


@pytest.mark.parametrize("model", get_args(Model))
def test_a_fine_plant_is_within_a_tenth_of_a_millimetre_of_the_continuum(model: Model) -> None:
    exact = BASE.continuum.positions(120)
    distances = np.linalg.norm(build_plant(model, BASE, 120).nodes - exact, axis=1)
    assert np.mean(distances) < 0.6e-4
    assert np.max(distances) < 1e-4


@pytest.mark.parametrize("model", get_args(Model))
def test_rest_shapes_between_pitched_grips_converge_in_second_order(model: Model) -> None:
    coarse, fine = (plant_error(model, PITCHED, n) for n in (21, 41))
    assert np.log2(coarse / fine) > 1.6
    assert fine < 0.6
