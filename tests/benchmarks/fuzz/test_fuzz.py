"""Fuzz campaign: services and readers survive it, it finds faults, and it can be resumed."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from benchmarks import fuzz
from benchmarks.fuzz.file_targets import FileTarget
from benchmarks.fuzz.message_targets import ServiceTarget, Totals
from cli.__main__ import main
from shared.scenario import load
from shared.service import Inbox

FILES = ("scenario", "nodes", "recording", "png", "jpeg")


@pytest.mark.parametrize("name", ["robot_gateway", "recorder"])
def test_a_service_survives_hostile_messages(name: str) -> None:
    totals = Totals()
    target = ServiceTarget(name, load(fuzz.DEFAULT_SCENARIO), ())
    target.run_batch(f"test/{name}", 1500, totals)
    target.close()
    assert totals.failures == []
    assert totals.accepted > 100


def test_a_service_that_raises_is_reported_with_its_seed(monkeypatch: pytest.MonkeyPatch) -> None:
    target = ServiceTarget("robot_gateway", load(fuzz.DEFAULT_SCENARIO), ())

    def fail(inbox: Inbox, now: int) -> None:
        raise KeyError("found")

    monkeypatch.setattr(target._service, "step", fail)
    totals = Totals()
    target.run_batch("seed-7", 100, totals)
    assert len(totals.failures) == 1
    assert "seed-7" in totals.failures[0]
    assert "KeyError: 'found'" in totals.failures[0]


def test_readers_of_files_refuse_in_one_way_only(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    progress = tmp_path / "progress.json"
    options = ["--count", "100", "--progress", str(progress), "--json"]
    assert main(["bench", "fuzz", "--targets", *FILES, *options]) == 0
    rows = json.loads(capsys.readouterr().out)["targets"]
    assert {name: row["messages"] for name, row in rows.items()} == dict.fromkeys(FILES, 100)
    # Resumed: what was read already is not read again.
    assert main(["bench", "fuzz", "--targets", *FILES, *options]) == 0
    assert json.loads(capsys.readouterr().out)["targets"] == rows


def test_another_exception_of_a_reader_is_a_failure() -> None:
    def read(content: bytes) -> None:
        raise OverflowError(len(content))

    totals = Totals()
    FileTarget("broken", b"valid = 1", read).run_batch("seed-3", 2, totals)
    assert len(totals.failures) == 2
    assert "broken seed-3" in totals.failures[0]
