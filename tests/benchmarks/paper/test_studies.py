"""Algorithm 2 shapes the paper's rod; reverse mode and adjoint agree on its gradient."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.paper.gradient_times import reverse_mode_gradient
from benchmarks.paper.studies import ShapingSpec, Study, run_trial
from lariat.paper.xpbd import XpbdProperties, XpbdRod
from lariat.rod import RolloutSpec


@pytest.mark.parametrize("study", [Study("actions", "xpbd"), Study("gauss_newton", "direct")])
def test_a_goal_behind_the_cylinders_is_reached_without_touching_them(study: Study) -> None:
    trial = run_trial(ShapingSpec(study, 0, 0, 300))
    assert trial.errors_mm[0] > 200.0
    assert trial.error_mm < 5.0
    assert trial.clearance_mm > 15.0


def test_adaptation_improves_the_prediction_of_a_softer_rope() -> None:
    errors = []
    for adapts in (False, True):
        study = Study("actions", "xpbd", softer=3.0, adapts=adapts)
        trial = run_trial(ShapingSpec(study, 0, 0, 100))
        errors.append(trial.prediction_mm)
        assert bool(trial.parameters) == adapts
    assert errors[1] < 0.5 * errors[0]


def test_taichis_reverse_mode_and_the_adjoint_agree() -> None:
    rod = XpbdRod(XpbdProperties(0.45, 0.008), 40, iterations=7)
    random = np.random.default_rng(0)
    actions = np.zeros((5, 2, 6))
    actions[:, :, :3] = 0.1 * random.normal(size=(5, 2, 3))
    slope = random.normal(size=(5, 40, 3))
    state = rod.straight([-0.225, 0.0, 0.3], [0.225, 0.0, 0.3])
    own = rod.gradient(RolloutSpec(state, actions, 0.01), slope).actions[:, :, :3]
    theirs = reverse_mode_gradient(rod, state, actions, slope)()
    assert np.linalg.norm(theirs - own) < 1e-11 * np.linalg.norm(own)
