"""Finished runs: series as arrays, tables, plots; several at once; values replaced in Python."""

from __future__ import annotations

import pickle
import sys
from dataclasses import replace
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pytest

from lariat.configuration import ConfigurationError
from lariat.scenario.settings import load_with
from shared.recording import Recording
from stack.simulation.closed_loop import RunOutcome, run, run_all
from stack.simulation.simulated_run import SimulatedRun

SETTINGS = {"sensing.source": "truth", "plant.model": "rod", "control.adapt": True}
SCENARIO = load_with("three-cylinders", {**SETTINGS, "run.time_limit": 1.0}, seed=4)


@pytest.fixture(scope="module")
def outcome(tmp_path_factory: pytest.TempPathFactory) -> RunOutcome:
    changed = replace(SCENARIO, rope=replace(SCENARIO.rope, youngs_modulus=1.5e6))
    file = tmp_path_factory.mktemp("runs") / "run.mcap"
    return run(changed, record=file)


def test_series_agree_with_the_score(outcome: RunOutcome) -> None:
    score = outcome.score
    count = len(outcome.times)
    assert outcome.nodes.shape == (count, SCENARIO.plant_rope.node_count, 3)
    assert 0.0 <= outcome.times[0] < outcome.times[-1] == pytest.approx(1.0, abs=0.1)
    last = outcome.times > outcome.times[-1] - 0.2
    assert 1e3 * outcome.errors[last].mean(axis=0) == pytest.approx(
        [score.final_error_mm, score.max_node_error_mm], abs=1e-3
    )
    assert 1e3 * outcome.clearances.min() == pytest.approx(score.min_clearance_mm, abs=1e-3)
    stiffness = outcome.parameters["bending_stiffness"]
    assert stiffness.shape == (len(outcome.parameter_times), 2)
    assert stiffness[-1].tolist() == score.parameters["bending_stiffness"]


def test_tables_have_columns_of_one_length(outcome: RunOutcome) -> None:
    nodes, errors = outcome.table("nodes"), outcome.table("errors")
    assert list(nodes) == ["time", "node", "x", "y", "z"]
    row = outcome.nodes.shape[1] + 7
    assert [nodes[name][row] for name in nodes] == [
        outcome.times[1],
        7,
        *outcome.nodes[1, 7],
    ]
    np.testing.assert_array_equal(errors["max_error"], outcome.errors[:, 1])
    estimates = outcome.table("parameters")
    assert len({len(column) for column in estimates.values()}) == 1
    chosen = estimates["name"] == "bending_stiffness"
    np.testing.assert_array_equal(
        estimates["deviation"][chosen], outcome.parameters["bending_stiffness"][:, 1]
    )
    with pytest.raises(ValueError, match=r"'nodes'.*'errors'.*'parameters'"):
        outcome.table("ropes")  # pyright: ignore[reportArgumentType]


def test_frame_without_pandas_names_the_way_out(
    outcome: RunOutcome, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(ConfigurationError, match="pip install pandas"):
        outcome.frame("errors")


def test_plot_draws_what_was_estimated(outcome: RunOutcome) -> None:
    mpl.use("Agg")
    assert len(outcome.plot().axes) == 3
    assert len(outcome.plot(["no_such_parameter"]).axes) == 2


def test_view_is_a_page_of_its_own(outcome: RunOutcome, tmp_path: Path) -> None:
    outcome.view(tmp_path / "run.html")
    assert "__VISER_EMBED_DATA__" in (tmp_path / "run.html").read_text()


def test_recording_holds_the_scenario_that_ran(outcome: RunOutcome, tmp_path: Path) -> None:
    assert outcome.score.recording is not None
    recorded = Recording.open(Path(outcome.score.recording)).scenario(tmp_path)
    assert recorded.rope.youngs_modulus == 1.5e6
    assert recorded == outcome.scenario


def test_runs_in_processes_are_those_of_this_one_in_order() -> None:
    scenarios = [
        replace(SCENARIO, seed=k, run=replace(SCENARIO.run, time_limit=0.3)) for k in (1, 2)
    ]
    runs = run_all(scenarios, workers=2, progress=False)
    assert [each.scenario.seed for each in runs] == [1, 2]
    alone = run(scenarios[1])
    np.testing.assert_array_equal(runs[1].nodes, alone.nodes)
    assert type(pickle.loads(pickle.dumps(runs[0]))) is SimulatedRun


def test_replaced_value_out_of_bounds_ends_before_the_run() -> None:
    wrong = replace(SCENARIO, rope=replace(SCENARIO.rope, linear_density=-1.0))
    with pytest.raises(ConfigurationError, match=r"rope\.linear_density"):
        run(wrong)
