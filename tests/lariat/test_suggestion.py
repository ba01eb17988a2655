"""Suggestions of the word or the file that was meant."""

from __future__ import annotations

from pathlib import Path

from lariat.suggestion import did_you_mean, did_you_mean_file


def test_the_most_similar_word_is_suggested_and_none_that_is_unlike():
    verbs = ["start", "status", "stop", "replay"]
    assert "'start'" in did_you_mean("strat", verbs)
    assert "'replay'" in did_you_mean("rep", verbs)
    assert did_you_mean("quit", verbs) == ""
    assert did_you_mean("", verbs) == ""


def test_a_file_beside_the_missing_one_is_suggested_with_its_folder(tmp_path: Path):
    (tmp_path / "run-1.mcap").touch()
    (tmp_path / "notes.md").touch()
    meant = did_you_mean_file(tmp_path / "run1.mcap")
    assert meant == f" did you mean '{tmp_path / 'run-1.mcap'}'?"
    assert did_you_mean_file(tmp_path / "missing" / "run.mcap") == ""
