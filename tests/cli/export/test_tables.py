"""Export to tables."""

from __future__ import annotations

import csv
from pathlib import Path

import pytest
from foxglove_schemas_protobuf.Log_pb2 import Log
from pyarrow import parquet

from cli.__main__ import main as lariat
from cli.export import main
from lariat.trajectory import SECOND
from shared import topics
from shared.messages import TaskState
from shared.topics import Topic
from tests.cli.export.recorded import STEP, recording
from tests.services.recorder.view import cell


@pytest.fixture(scope="module")
def file(tmp_path_factory) -> Path:
    return recording(tmp_path_factory.mktemp("tables"))


def test_csv_has_a_table_for_each_topic_with_values(file: Path, tmp_path: Path):
    assert main((file,), "csv", tmp_path / "tables") == 0
    names = {path.stem for path in (tmp_path / "tables").iterdir()}
    assert names == {
        "rope_nodes",
        "rope_truth",
        "task_state",
        "controller_plan",
        "controller_path",
        "scene_state",
        "arm_state",
        "arm_setpoints",
        "camera_overhead_calibration",
        "log_sim",
        "view_joints",
    }
    with (tmp_path / "tables" / "arm_state.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    assert len(rows) == 10
    assert float(rows[3]["time"]) == pytest.approx(3 * STEP / SECOND)
    assert int(rows[3]["log_time"]) == cell.NOW + 3 * STEP
    assert int(rows[3]["publish_time"]) == cell.NOW + 3 * STEP - STEP // 10
    assert float(rows[3]["arms.right.position.x"]) == 0.2
    assert rows[3]["mode"] == "DISARMED"
    with (tmp_path / "tables" / "rope_nodes.csv").open() as stream:
        (row, *_) = csv.DictReader(stream)
    assert float(row["positions.3.z"]) == 0.3
    assert float(row["sigma.1"]) == 1e-3


def test_parquet_has_the_same_columns(file: Path, tmp_path: Path):
    assert main((file,), "parquet", tmp_path / "tables") == 0
    table = parquet.read_table(tmp_path / "tables" / "arm_state.parquet")
    assert table.num_rows == 10
    assert table["arms.right.position.x"].to_pylist() == [0.2] * 10


def test_an_export_replaces_nothing(file: Path, tmp_path: Path, capsys):
    assert lariat(["export", str(file), "--to", "csv", "--output", str(tmp_path)]) == 2
    err = capsys.readouterr().err
    assert f"{tmp_path}" in err
    assert "--output" in err


def test_a_library_that_is_missing_is_named(file: Path, tmp_path: Path, monkeypatch, capsys):
    monkeypatch.setitem(__import__("sys").modules, "pyarrow", None)
    output = str(tmp_path / "out")
    assert lariat(["export", str(file), "--to", "parquet", "--output", output]) == 2
    assert "pyarrow" in capsys.readouterr().err


@pytest.mark.parametrize("to", ["csv", "ros2", "parquet"])
@pytest.mark.parametrize("drawn", [True, False])
def test_messages_that_cannot_be_read_are_left_out(
    to: str, drawn: bool, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    def spoil(topic: Topic, payload: bytes, k: int) -> bytes:
        return b"\xff" * 20 if topic is topics.ROPE_NODES and k in (4, 5) else payload

    file = recording(tmp_path, drawn, spoil)
    assert lariat(["export", str(file), "--to", to]) == 0
    said = capsys.readouterr().err
    assert f"lariat: 2 messages of {file}" in said
    if to == "csv":
        assert len((tmp_path / "small_csv" / "rope_nodes.csv").read_text().splitlines()) == 9


@pytest.mark.parametrize("to", ["csv", "ros2", "parquet"])
def test_values_that_nobody_knows_do_not_end_an_export(
    to: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    def spoil(topic: Topic, payload: bytes, k: int) -> bytes:
        if k == 3 and topic is topics.TASK_STATE:
            return TaskState(state=99).SerializeToString()  # pyright: ignore[reportArgumentType]
        if k == 3 and topic.key == topics.LOG.at("sim").key:
            return Log(level=99).SerializeToString()  # pyright: ignore[reportArgumentType]
        return payload

    file = recording(tmp_path, False, spoil)
    assert lariat(["export", str(file), "--to", to]) == 0
    if to == "csv":
        with (tmp_path / "small_csv" / "task_state.csv").open() as stream:
            assert [row["state"] for row in csv.DictReader(stream)][3] == "99"


def test_export_that_fails_is_one_line(
    file: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    def fail(*_: object) -> str:
        raise KeyError("x")

    monkeypatch.setattr("cli.export.tables.write_csv", fail)
    assert lariat(["export", str(file), "--to", "csv", "--output", str(tmp_path / "t")]) == 2
    assert capsys.readouterr().err == f"lariat: cannot export {file}: KeyError: 'x'\n"
