"""Algorithm 2 shapes the paper's rod; reverse mode and adjoint agree on its gradient."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.paper.gradient_times import reverse_mode_gradient
from benchmarks.paper.studies import Study, StudyRunner
from lariat.paper.xpbd import XpbdProperties, XpbdRod
from lariat.rod import RolloutSpec


@pytest.fixture(scope="module")
def runner() -> StudyRunner:
    return StudyRunner(seed=0)


@pytest.mark.parametrize("study", [Study("actions", "xpbd"), Study("gauss_newton", "direct")])
def test_a_goal_behind_the_cylinders_is_reached_without_touching_them(
    runner: StudyRunner, study: Study
) -> None:
    seen = []
    outcome = runner.run(study, 1, 300, lambda goal, error: seen.append(error))
    (run,) = outcome.runs
    assert run.errors[0] > 0.2
    assert run.final_error < 0.005
    assert run.clearance > 0.015
    assert len(seen) == len(run.horizon_times)


def test_adaptation_improves_the_prediction_of_a_softer_rope(runner: StudyRunner) -> None:
    errors = []
    for adapts in (False, True):
        study = Study("actions", "xpbd", softer=3.0, adapts=adapts)
        (run,) = runner.run(study, 1, 100, lambda goal, error: None).runs
        errors.append(np.mean(run.prediction_errors[-20:]))
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
