"""Fuzz campaign: services and readers survive it, it finds faults, and it can be resumed."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest

from benchmarks.faults import fuzz
from benchmarks.faults.fuzz.arm_targets import ClientTarget, EmulatorTarget
from benchmarks.faults.fuzz.dashboard_target import DashboardTarget
from benchmarks.faults.fuzz.file_targets import FileTarget, file_targets
from benchmarks.faults.fuzz.launcher_target import LauncherTarget
from benchmarks.faults.fuzz.message_targets import ServiceTarget, Totals
from cli.__main__ import main
from lariat.scenario import load
from shared.cr5.packet import PacketReader
from shared.runtime.service import Inbox

FILES = ("scenario", "nodes", "recording", "png", "jpeg")


@pytest.mark.parametrize("name", ["robot_gateway", "recorder"])
def test_a_service_survives_hostile_messages(name: str) -> None:
    totals = Totals()
    target = ServiceTarget(name, load(fuzz.DEFAULT_SCENARIO), ())
    target.run_batch(f"test/{name}", 1500, totals)
    target.close()
    assert totals.failures == []
    assert totals.accepted > 100


def test_a_drawn_page_survives_hostile_messages() -> None:
    totals = Totals()
    target = DashboardTarget(load(fuzz.DEFAULT_SCENARIO), ())
    target.run_batch("test/dashboard", 1500, totals)
    target.close()
    assert totals.failures == []
    assert totals.accepted > 300


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
    assert main(["bench", "faults", "fuzz", "--targets", *FILES, *options]) == 0
    rows = json.loads(capsys.readouterr().out)["targets"]
    assert {name: row["messages"] for name, row in rows.items()} == dict.fromkeys(FILES, 100)
    # Resumed: what was read already is not read again.
    assert main(["bench", "faults", "fuzz", "--targets", *FILES, *options]) == 0
    assert json.loads(capsys.readouterr().out)["targets"] == rows


def test_meshes_are_covered_or_refused(tmp_path: Path) -> None:
    totals = Totals()
    targets = file_targets(load(fuzz.DEFAULT_SCENARIO), tmp_path)
    for name in ("stl", "obj"):
        targets[name].run_batch(f"test/{name}", 8, totals)
    assert (totals.messages, totals.failures) == (16, [])
    assert totals.accepted > 0


@pytest.mark.parametrize(
    ("build", "count"),
    [(lambda: LauncherTarget(()), 200), (ClientTarget, 20), (EmulatorTarget, 200)],
    ids=["launcher", "client", "emulator"],
)
def test_launcher_and_both_ends_of_an_arms_line_survive_hostile_bytes(
    build: Callable[[], fuzz.Target], count: int
) -> None:
    totals = Totals()
    target = build()
    target.run_batch("test", count, totals)
    target.close()
    assert (totals.messages, totals.failures) == (count, [])


def test_doors_of_a_bus_and_the_page_survive_hostile_messages(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert (
        main(["bench", "faults", "fuzz", "--targets", "bus", "page", "--count", "256", "--json"])
        == 0
    )
    rows = json.loads(capsys.readouterr().out)["targets"]
    assert {name: row["messages"] for name, row in rows.items()} == {"bus": 256, "page": 256}
    assert 0 < rows["bus"]["accepted"] < 256


def test_exception_of_the_arms_client_is_a_failure(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(reader: PacketReader, data: bytes) -> None:
        raise KeyError("found")

    monkeypatch.setattr(PacketReader, "feed", fail)
    totals = Totals()
    target = ClientTarget()
    target.run_batch("seed-5", 3, totals)
    assert totals.failures
    assert "cr5-client seed-5" in totals.failures[0]


def test_another_exception_of_a_reader_is_a_failure() -> None:
    def read(content: bytes) -> None:
        raise OverflowError(len(content))

    totals = Totals()
    FileTarget("broken", b"valid = 1", read).run_batch("seed-3", 2, totals)
    assert len(totals.failures) == 2
    assert "broken seed-3" in totals.failures[0]
