"""Short names of shipped scenarios, from any folder."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from lariat.configuration import ConfigurationError
from lariat.scenario import find, load
from lariat.scenario.shipped import SHIPPED_FOLDER, shipped_names

ROOT = Path(__file__).parents[3]


@pytest.mark.parametrize("name", ["rope", "rope.toml"])
def test_a_short_name_is_found_from_any_folder(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.chdir(tmp_path)
    assert find(name) == SHIPPED_FOLDER / "rope.toml"
    assert load(name) == load(ROOT / "scenarios" / "rope.toml")


def test_an_existing_file_comes_before_a_shipped_scenario_of_its_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "rope.toml").write_text("")
    assert find("rope.toml") == Path("rope.toml")
    assert find("rope") == SHIPPED_FOLDER / "rope.toml"
    (tmp_path / "rope").mkdir()
    assert find("rope") == SHIPPED_FOLDER / "rope.toml"


@pytest.mark.parametrize("name", ["ropes", "nowhere/rope", "nowhere/rope.toml", "rope.csv"])
def test_an_unknown_scenario_is_refused_with_the_names_of_the_shipped_ones(name: str):
    with pytest.raises(ConfigurationError, match=f"cannot read scenario {name}: .*three-cyl") as e:
        find(name)
    assert all(shipped in str(e.value) for shipped in shipped_names())


def test_a_verb_takes_a_short_name_in_a_folder_without_scenarios(tmp_path: Path):
    answer = subprocess.run(
        [sys.executable, "-m", "cli", "run", "rope", "--set", "rope.length=-1"],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        timeout=60.0,
    )
    assert "rope.length" in answer.stderr
    assert answer.returncode == 2
