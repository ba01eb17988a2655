"""Results of benches: on the terminal, as one JSON object, and as CSV."""

from __future__ import annotations

import csv
import json
from dataclasses import dataclass
from pathlib import Path

import pytest

from benchmarks.tables import PrintOptions, Result
from lariat.configuration import ConfigurationError


@dataclass(frozen=True)
class Spec:
    name: str


@dataclass(frozen=True)
class Row:
    spec: Spec
    errors_mm: list[float]
    held: bool
    reached: float | None


ROWS = [Row(Spec("sim [2]"), [0.123456, 2.0], True, float("nan"))]


def test_dataclasses_are_rows_of_a_table_and_of_one_json_object(
    capsys: pytest.CaptureFixture[str],
) -> None:
    PrintOptions().publish(Result("rows", ROWS, "plant: rod"))
    text = capsys.readouterr().out
    for cell in ("errors mm", "sim [2]", "0.1235, 2", "yes", "–", "plant: rod"):
        assert cell in text
    PrintOptions(json=True).publish(Result("rows", ROWS))
    row = {"name": "sim [2]", "errors_mm": [0.123456, 2.0], "held": True, "reached": None}
    assert json.loads(capsys.readouterr().out) == {"rows": [row]}


def test_details_stand_in_json_and_csv_alone(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    summary = Result("summary", [{"good": 1}, {"bad": 2}])
    for as_json in (False, True):
        options = PrintOptions(as_json, tmp_path / "new")
        options.publish(summary, details=[Result("trials", ROWS)])
    table, _, parsed = capsys.readouterr().out.rpartition("\n{")
    assert "good" in table
    assert "sim" not in table
    assert set(json.loads("{" + parsed)) == {"summary", "trials"}
    with (tmp_path / "new" / "trials.csv").open() as stream:
        (row,) = csv.DictReader(stream)
    assert row == {"name": "sim [2]", "errors_mm": "0.1235, 2", "held": "yes", "reached": "–"}
    assert (tmp_path / "new" / "summary.csv").read_text() == "good,bad\n1,\n,2\n"


def test_a_folder_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    blocked = tmp_path / "file"
    blocked.touch()
    with pytest.raises(ConfigurationError, match=str(blocked)):
        PrintOptions(output=blocked).publish(Result("rows", ROWS))
