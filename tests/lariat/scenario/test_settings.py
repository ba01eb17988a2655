"""Scenarios whose values are replaced, by settings or as dataclasses, stay scenarios of a file."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lariat.configuration import ConfigurationError
from lariat.scenario import load, parse
from lariat.scenario.settings import completed, load_with, with_settings
from lariat.scenario.shipped import SHIPPED_FOLDER

SHIPPED = sorted(SHIPPED_FOLDER.glob("*.toml"))


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.stem)
def test_scenario_without_its_file_is_written_whole(path: Path) -> None:
    scenario = load(path)
    assert completed(scenario) is scenario
    again = completed(replace(scenario, text=""))
    assert again.rope.length == pytest.approx(scenario.rope.length, abs=1e-15)
    assert replace(again, rope=scenario.rope) == scenario
    assert parse(again.text, path.parent) == again


def test_settings_are_a_mapping_or_texts() -> None:
    by_texts = load_with("three-cylinders", ["rope.youngs_modulus=2e6", "obstacles.0.radius=0.02"])
    settings = {"rope.youngs_modulus": 2e6, "obstacles.0.radius": np.float64(0.02)}
    assert load_with("three-cylinders", settings) == by_texts
    assert load_with("three-cylinders", settings, seed=5) == replace(by_texts, seed=5)


def test_replaced_values_are_in_the_text_and_under_further_settings() -> None:
    scenario = load("three-cylinders")
    nodes = np.linspace([-0.2, 0.1, 0.3], [0.2, 0.1, 0.3], 30)
    nodes[:, 2] -= 0.11 * np.cos(np.linspace(-np.pi / 2, np.pi / 2, 30))
    changed = replace(
        scenario,
        seed=3,
        goal=replace(scenario.goal, nodes=nodes * 0.45 / 0.4633),
        run=replace(scenario.run, time_limit=2.0),
    )
    whole = completed(changed)
    assert parse(whole.text, scenario.folder) == changed
    assert with_settings(changed, {"run.tolerance": 0.01}).run.time_limit == 2.0


def test_replaced_value_out_of_bounds_is_refused_by_name() -> None:
    scenario = load("three-cylinders")
    wrong = replace(scenario, rope=replace(scenario.rope, youngs_modulus=-1.0))
    with pytest.raises(ConfigurationError, match=r"rope\.youngs_modulus = -1\.0 Pa"):
        completed(wrong)
