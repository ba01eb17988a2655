from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from dashboard.action_queue import ActionQueue
from dashboard.outbox import Outbox
from dashboard.panels.chart import MARK_WIDTH
from dashboard.panels.parameter_panel import ParameterPanel, table_html, true_values
from dashboard.web.private_viser import PrivateViser
from lariat.scenario import load
from lariat.trajectory import SECOND
from shared.messages import Estimate, Parameters, RodParameters, TaskState
from shared.messages.parameters import named_parameters

SCENARIO = load("scenarios/rope.toml")


def message(second: float, stiffness: float, sigma: float) -> Parameters:
    estimate = Estimate(value=stiffness, standard_deviation=sigma)
    rod = RodParameters(bending_stiffness=estimate, length=Estimate(value=0.45))
    return Parameters(stamp=round((1 + second) * SECOND), rod=rod)


@pytest.fixture
def panel() -> Iterator[ParameterPanel]:
    private = PrivateViser("test")
    yield ParameterPanel(private.server.gui, SCENARIO, ActionQueue(), Outbox("test"), live=True)
    private.close()


def test_estimate_is_drawn_with_its_deviation_and_the_true_value(panel: ParameterPanel) -> None:
    panel.add(message(0.0, 2e-4, 1e-4))
    panel.add(message(1.0, 3e-4, 2e-5))
    panel.draw(1.0)
    times, truth, value, upper, lower, marks = panel._estimate.data
    np.testing.assert_allclose(times, [0.0, 1.0])
    np.testing.assert_allclose(value, [2e-4, 3e-4])
    np.testing.assert_allclose(upper - value, [1e-4, 2e-5])
    np.testing.assert_allclose(value - lower, [1e-4, 2e-5])
    np.testing.assert_allclose(truth, true_values(SCENARIO)["bending_stiffness"])
    assert not np.isfinite(marks[1:]).any()
    assert panel._estimate.title == "bending stiffness [N m^2]"


def test_history_goes_on_over_runs_whose_starts_are_marked(panel: ParameterPanel) -> None:
    for second in (0.0, 1.0, 2.0, 3.0):
        if second in (1.0, 2.5):
            panel.mark_run(TaskState(run_started=message(second, 0.0, 0.0).stamp))
        panel.add(message(second, 2e-4 + 1e-5 * second, 1e-5))
    for second in (2.5, 2.5, 9.0):
        panel.mark_run(TaskState(run_started=message(second, 0.0, 0.0).stamp))
    panel.draw(3.0)
    times, truth, value, upper, lower, marks = panel._estimate.data
    np.testing.assert_allclose(value, 2e-4 + 1e-5 * times, rtol=1e-6)
    low, high = min(lower.min(), truth[0]), max(upper.max(), truth[0])
    (up,) = np.nonzero(marks == high)
    np.testing.assert_allclose(times[up], [1.0, 2.5], atol=2 * MARK_WIDTH)
    np.testing.assert_allclose(marks[up - 1], low)
    # The library finds no range where a first value is NaN; nothing is drawn to it.
    assert np.isfinite(marks[0])
    assert np.isfinite(marks).sum() == 5


def test_true_values_are_those_of_the_simulated_rope_and_of_no_real_one() -> None:
    hidden = SCENARIO.plant.rope.youngs_modulus
    assert hidden is not None
    inertia = np.pi * SCENARIO.rope.diameter**4 / 64.0
    assert true_values(SCENARIO)["bending_stiffness"] == pytest.approx(hidden * inertia)
    left = replace(SCENARIO.ends.left, driver="cr5", address="192.0.2.1")
    real = replace(SCENARIO, ends=replace(SCENARIO.ends, left=left))
    assert true_values(real) == {}


def test_table_shows_no_deviation_of_what_is_given() -> None:
    text = table_html(named_parameters(message(0.0, 2e-4, 1e-4)))
    assert "± 0.0001" in text
    assert text.count("±") == 1
