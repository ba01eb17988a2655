"""Fuzz bench: processes and readers survive it, and it finds faults."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from benchmarks.faults.fuzz import bench, targets
from benchmarks.faults.fuzz.bench import FuzzSpec, attack
from benchmarks.faults.fuzz.targets import _Stepping
from cli.__main__ import main

FILES = ("scenario", "nodes", "recording", "png", "jpeg", "stl", "obj")


def fuzzed(target: str, count: int) -> bench.FuzzTrial:
    return attack(FuzzSpec(target, count, seed=3, scenario="three-cylinders"))


@pytest.mark.parametrize(
    ("target", "count"),
    [("robot_gateway", 150), ("recorder", 60), ("dashboard", 60), ("launcher", 10), ("bus", 40)],
)
def test_a_process_survives_hostile_messages(target: str, count: int) -> None:
    trial = fuzzed(target, count)
    assert trial.failure == ""
    assert trial.given >= count
    assert trial.accepted > count / 4


def test_readers_of_files_refuse_in_one_way_only(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    results = tmp_path / "fuzz.jsonl"
    options = ["--count", "12", "--results", str(results), "--json"]
    assert main(["bench", "faults", "fuzz", "--targets", *FILES, *options]) == 0
    rows = json.loads(capsys.readouterr().out)["rows"]
    assert {row["target"] for row in rows if row["given"] >= 12} == set(FILES)


def test_a_service_that_raises_is_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(step: _Stepping, messages: targets.Messages) -> int:
        raise KeyError("found")

    monkeypatch.setattr(_Stepping, "__call__", fail)
    trial = fuzzed("robot_gateway", 20)
    assert "KeyError: 'found'" in trial.failure
    assert trial.given < 20


def test_another_exception_of_a_reader_is_a_failure(monkeypatch: pytest.MonkeyPatch) -> None:
    def parse(content: str, folder: Path) -> None:
        raise OverflowError(len(content))

    monkeypatch.setattr(targets, "parse", parse)
    assert "OverflowError" in fuzzed("nodes", 5).failure


def test_an_arm_that_moves_is_a_failure(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(targets, "STILL", -1.0)
    assert "an arm moved by 0.000 mm" in fuzzed("robot_gateway", 5).failure
