"""Library of scenarios: names, copies with their files, deletion."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from lariat.configuration import ConfigurationError
from lariat.files.toml_text import parse_toml
from lariat.scenario import find, load
from lariat.scenario.settings import load_with, to_toml
from stack.scenario_manager.library import ScenarioLibrary


def library(folder: Path) -> ScenarioLibrary:
    return ScenarioLibrary(folder / "saved", find("three-cylinders"))


def test_shipped_scenarios_are_listed_with_their_descriptions(tmp_path: Path) -> None:
    entries = {entry.name: entry for entry in library(tmp_path).entries}
    assert entries["rope"].description == load("rope").description
    assert not entries["rope"].own
    assert list(entries["fixed-end"].real_arms) == []


def test_file_given_by_its_path_is_listed_by_it(tmp_path: Path) -> None:
    path = tmp_path / "three-cylinders.toml"
    path.write_text(load("three-cylinders").text)
    found = ScenarioLibrary(tmp_path / "saved", path)
    assert found.name_of(path) == str(path)
    assert found.find(str(path)) == path


def test_saved_scenario_brings_the_files_that_it_names(tmp_path: Path) -> None:
    scenarios = library(tmp_path)
    scenarios.save(load_with(Path("rope"), ["control.clearance=0.02"]), "soft-rope")
    saved = load(scenarios.find("soft-rope"))
    assert (saved.name, saved.control.clearance) == ("soft-rope", 0.02)
    rope = load("rope")
    assert (saved.nodes(saved.goal) == rope.nodes(rope.goal)).all()
    # Another stack finds it.
    assert [e.name for e in library(tmp_path).entries if e.own] == ["soft-rope"]


def test_saving_again_replaces_and_deleting_removes_the_folder(tmp_path: Path) -> None:
    scenarios = library(tmp_path)
    scenarios.save(load("three-cylinders"), "mine")
    scenarios.save(load_with(scenarios.find("mine"), ["seed=7"]), "mine")
    assert load(scenarios.find("mine")).seed == 7
    scenarios.delete("mine")
    assert list((tmp_path / "saved").iterdir()) == []
    with pytest.raises(ConfigurationError, match="no scenario 'mine'"):
        scenarios.find("mine")


@pytest.mark.parametrize(
    ("name", "words"),
    [("../evil", "no name"), ("", "no name"), ("A b", "no name"), ("rope", "shipped")],
)
def test_name_that_leads_elsewhere_is_refused(tmp_path: Path, name: str, words: str) -> None:
    with pytest.raises(ConfigurationError, match=words):
        library(tmp_path).save(load("rope"), name)
    assert not (tmp_path / "saved").exists()


@pytest.mark.parametrize("name", ["rope", "..", "", "unknown"])
def test_only_saved_scenarios_are_deleted(tmp_path: Path, name: str) -> None:
    with pytest.raises(ConfigurationError, match="no saved scenario"):
        library(tmp_path).delete(name)


def test_links_in_a_circle_are_left_out(tmp_path: Path) -> None:
    (tmp_path / "saved/round").mkdir(parents=True)
    (tmp_path / "saved/round/round.toml").symlink_to("round.toml")
    scenarios = library(tmp_path)
    assert not [entry for entry in scenarios.entries if entry.own]
    assert scenarios.name_of(find("rope")) == "rope"


def test_file_that_is_no_scenario_is_left_out(tmp_path: Path) -> None:
    (tmp_path / "saved" / "broken").mkdir(parents=True)
    (tmp_path / "saved" / "broken" / "broken.toml").write_text("[rope")
    assert "broken" not in {entry.name for entry in library(tmp_path).entries}


def test_next_goals_and_events_bring_their_files(tmp_path: Path) -> None:
    rope = load("rope")
    folder = tmp_path / "own"
    folder.mkdir()
    for name in ("start.csv", "goal.csv", "next.csv", "event.csv"):
        shutil.copyfile(rope.folder / rope.goal.file, folder / name)
    table = parse_toml(rope.text)
    table["goal"] = {**table["goal"], "nodes": "goal.csv"}
    table["next_goals"] = [{**table["goal"], "nodes": "next.csv"}]
    table["events"] = [{"time": 1.0, "goal": {**table["goal"], "nodes": "event.csv"}}]
    (folder / "own.toml").write_text(to_toml(table))
    scenarios = ScenarioLibrary(tmp_path / "saved", folder / "own.toml")
    scenarios.save(load(folder / "own.toml"), "mine")
    saved = load(scenarios.find("mine"))
    assert set(saved.shape_files) >= {"goal.csv", "next.csv", "event.csv"}
    assert saved.nodes(saved.next_goals[0]) is not None
