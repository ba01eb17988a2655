"""Export as a LeRobot data set."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path

import cv2
import numpy as np
import pytest
from pyarrow import parquet
from rerun.experimental import LeRobotReader

from cli.__main__ import main as lariat
from cli.export import main

ROOT = Path(__file__).parents[3]
RECORDING = ROOT / "tests" / "replay" / "rope.mcap"
LEROBOT = ROOT / ".venv-lerobot" / "bin" / "python"
LOADER = Path(__file__).with_name("lerobot_loader.py")


@pytest.fixture(scope="module")
def dataset(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("lerobot") / "dataset"
    assert main((RECORDING, RECORDING), "lerobot", folder) == 0
    return folder


def test_each_recording_is_an_episode(dataset: Path):
    info = json.loads((dataset / "meta" / "info.json").read_text())
    episodes = parquet.read_table(dataset / "meta/episodes/chunk-000/file-000.parquet")
    (length, again) = episodes["length"].to_pylist()
    assert length == again > 20
    assert info["total_episodes"] == 2
    assert info["total_frames"] == episodes["dataset_to_index"].to_pylist()[1] == 2 * length
    assert parquet.read_table(dataset / "meta/tasks.parquet").num_rows == 1


def test_frames_lie_evenly_and_hold_what_was_commanded(tmp_path: Path):
    recording = RECORDING.with_name("three-cylinders.mcap")
    assert main((recording,), "lerobot", tmp_path / "dataset") == 0
    frames = parquet.read_table(tmp_path / "dataset/data/chunk-000/file-000.parquet")
    assert np.allclose(np.diff(frames["timestamp"].to_numpy()), 0.05, atol=1e-6)
    state = np.array(frames["observation.state"].to_pylist())
    action = np.array(frames["action"].to_pylist())
    assert state.shape == action.shape == (frames.num_rows, 14)
    # The action of a frame is where the grips are in the next one, but for the lag of the arms.
    moved = np.linalg.norm(state[1:, :3] - state[:-1, :3], axis=1)
    ahead = np.linalg.norm(action[:-1, :3] - state[1:, :3], axis=1)
    assert moved.max() > 5e-3
    assert np.median(ahead) < 0.5 * np.median(moved)


def test_rerun_reads_the_frames_of_every_episode(dataset: Path):
    reader = LeRobotReader(dataset)
    assert reader.episodes() == [0, 1]
    rows = {}
    for chunk in reader.stream(1):
        rows.setdefault(chunk.entity_path, {}).update(chunk.to_record_batch().to_pydict())
    frames = parquet.read_table(dataset / "data/chunk-000/file-001.parquet")
    for key in ("observation.state", "action", "observation.goal"):
        assert rows[f"/{key}"]["Scalars:scalars"] == frames[key].to_pylist()
    pictures = rows["/observation.images.overhead"]["EncodedImage:blob"]
    assert len(pictures) == frames.num_rows
    picture = cv2.imdecode(np.array(pictures[0][0], np.uint8), cv2.IMREAD_COLOR)
    assert picture is not None
    assert picture.shape == (120, 160, 3)


def test_statistics_bound_the_frames(dataset: Path):
    statistics = json.loads((dataset / "meta" / "stats.json").read_text())
    frames = parquet.read_table(dataset / "data/chunk-000/file-000.parquet")
    nodes = np.array(frames["observation.environment_state"].to_pylist())
    stated = statistics["observation.environment_state"]
    assert np.allclose(stated["min"], nodes.min(0), atol=1e-6)
    assert np.allclose(stated["mean"], nodes.mean(0), atol=1e-6)
    image = statistics["observation.images.overhead"]
    assert np.shape(image["mean"]) == (3, 1, 1)
    assert 0.0 <= np.min(image["min"]) <= np.max(image["max"]) <= 1.0


def test_recordings_of_other_cells_are_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    others = [str(RECORDING), str(RECORDING.with_name("three-cylinders.mcap"))]
    assert lariat(["export", *others, "--to", "lerobot", "--output", str(tmp_path / "a")]) == 2
    assert "three-cylinders.mcap has other" in capsys.readouterr().err
    assert lariat(["export", *others, "--to", "csv", "--output", str(tmp_path / "b")]) == 2
    assert "--to csv takes one" in capsys.readouterr().err
    camera = str(RECORDING.with_name("camera.mcap"))
    assert lariat(["export", camera, "--to", "lerobot", "--output", str(tmp_path / "c")]) == 2
    assert "camera.mcap holds no frame" in capsys.readouterr().err


@pytest.mark.skipif(
    not LEROBOT.exists(),
    reason="no LeRobot; it needs an environment of its own: "
    "python -m venv .venv-lerobot && .venv-lerobot/bin/pip install lerobot",
)
def test_loader_of_lerobot_opens_the_data_set(dataset: Path):
    loaded = subprocess.run(
        [str(LEROBOT), str(LOADER), str(dataset)], capture_output=True, text=True, check=False
    )
    assert loaded.returncode == 0, loaded.stderr
    frames = parquet.read_table(dataset / "data/chunk-000/file-001.parquet")
    answer = json.loads(loaded.stdout.splitlines()[-1])
    assert answer["episodes"] == 2
    assert answer["frames"] == 2 * frames.num_rows
    assert answer["action"] == pytest.approx(frames["action"].to_pylist()[-1])
    assert answer["image"] == [3, 120, 160]
    assert answer["task"].startswith("Shape the rope")
