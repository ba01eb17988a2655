"""Files of a LeRobot data set, layout v3.0. LeRobot itself is not needed to write them."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
from pyarrow import parquet

from cli.export.lerobot.episode import (
    ACTION,
    FRAME_RATE,
    GOAL,
    IMAGE,
    NODES,
    STATE,
    Episode,
    read_episode,
)
from cli.export.lerobot.statistics import Statistics
from lariat.files.image_header import check_image
from shared.recording import Recording

LAYOUT_VERSION = "v3.0"
"""Version of LeRobot's layout of files."""
POSE_NAMES = ("x", "y", "z", "qw", "qx", "qy", "qz")
"""Names of the numbers of a pose: position [m], orientation (wxyz)."""
DATA_PATH = "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"
EPISODES_PATH = "meta/episodes/chunk-000/file-000.parquet"
MAX_EPISODES = 1000
"""Largest number of episodes, which lie in one chunk of files."""


def write(recordings: Sequence[Recording], folder: Path) -> str:
    """Write the data set into a new folder; return one line about it."""
    if not 0 < len(recordings) <= MAX_EPISODES:
        raise ValueError(f"a data set takes 1 to {MAX_EPISODES} recordings, got {len(recordings)}")
    features: dict[str, dict[str, Any]] = {}
    tasks: list[str] = []
    rows, statistics = [], Statistics()
    count = 0
    for index, recording in enumerate(recordings):
        episode = read_episode(recording)
        if not episode.frames:
            raise ValueError(f"{recording.path} holds no frame of a run with arms, rope and goal")
        own_features = _features(episode)
        if features and own_features != features:
            first = recordings[0].path
            raise ValueError(f"{recording.path} has other arms, nodes or images than {first}")
        features = own_features
        tasks += [episode.task] if episode.task not in tasks else []
        if not index:
            (folder / "meta").mkdir(parents=True)
        _write_frames(episode, features, index, count, tasks.index(episode.task), folder)
        statistics.add(episode.frames)
        end = count + len(episode.frames)
        rows.append({"task": episode.task, "from": count, "to": end})
        count = end
    _write_episodes(rows, folder)
    _write_tasks(tasks, folder)
    _write_json(statistics.summary(), folder / "meta" / "stats.json")
    _write_json(_info(features, len(rows), count, len(tasks)), folder / "meta" / "info.json")
    episodes = "1 episode" if len(rows) == 1 else f"{len(rows)} episodes"
    return f"{folder}: {episodes} with {count} frames, for LeRobot ({LAYOUT_VERSION})"


def _features(episode: Episode) -> dict[str, dict[str, Any]]:
    """Features of the data set, as `info.json` has them."""
    first = episode.frames[0]
    pose = [f"{arm}.{name}" for arm in episode.arms for name in POSE_NAMES]
    chain = [f"{k}.{c}" for k in range(len(first[NODES]) // 3) for c in "xyz"]
    goal = [f"{k}.{c}" for k in range(len(first[GOAL]) // 3) for c in "xyz"]
    names = {STATE: pose, ACTION: pose, NODES: chain, GOAL: goal}
    features: dict[str, dict[str, Any]] = {
        name: {"dtype": "float32", "shape": [len(of)], "names": of} for name, of in names.items()
    }
    if IMAGE in first:
        width, height = check_image(first[IMAGE])
        shape = {"shape": [height, width, 3], "names": ["height", "width", "channels"]}
        features[IMAGE] = {"dtype": "image", **shape}
    features["timestamp"] = {"dtype": "float32", "shape": [1], "names": None}
    for name in ("frame_index", "episode_index", "index", "task_index"):
        features[name] = {"dtype": "int64", "shape": [1], "names": None}
    return features


def _write_frames(
    episode: Episode, features: dict[str, Any], index: int, first: int, task: int, folder: Path
) -> None:
    frames, count = episode.frames, len(episode.frames)
    numbers = np.arange(count)
    columns = {
        "timestamp": pa.array((numbers / FRAME_RATE).astype(np.float32)),
        "frame_index": pa.array(numbers),
        "episode_index": pa.array(np.full(count, index)),
        "index": pa.array(first + numbers),
        "task_index": pa.array(np.full(count, task)),
    }
    for name, feature in features.items():
        if feature["dtype"] == "image":
            images = [{"bytes": frame[name], "path": None} for frame in frames]
            kind = pa.struct([("bytes", pa.binary()), ("path", pa.string())])
            columns[name] = pa.array(images, kind)
        elif name not in columns:
            values = pa.array(np.concatenate([frame[name] for frame in frames]))
            columns[name] = pa.FixedSizeListArray.from_arrays(values, feature["shape"][0])
    path = folder / DATA_PATH.format(chunk_index=0, file_index=index)
    path.parent.mkdir(parents=True, exist_ok=True)
    parquet.write_table(pa.table({name: columns[name] for name in features}), path)


def _write_episodes(rows: list[dict[str, Any]], folder: Path) -> None:
    columns = {
        "episode_index": list(range(len(rows))),
        "tasks": [[row["task"]] for row in rows],
        "length": [row["to"] - row["from"] for row in rows],
        "data/chunk_index": [0] * len(rows),
        "data/file_index": list(range(len(rows))),
        "dataset_from_index": [row["from"] for row in rows],
        "dataset_to_index": [row["to"] for row in rows],
        "meta/episodes/chunk_index": [0] * len(rows),
        "meta/episodes/file_index": [0] * len(rows),
    }
    path = folder / EPISODES_PATH
    path.parent.mkdir(parents=True)
    parquet.write_table(pa.table(columns), path)


def _write_tasks(tasks: list[str], folder: Path) -> None:
    """Write the tasks; LeRobot reads them by pandas, with their text as the index."""
    table = pa.table({"task_index": list(range(len(tasks))), "task": tasks})
    columns = [
        {"name": n, "field_name": n, "pandas_type": kind, "numpy_type": of, "metadata": None}
        for n, kind, of in (("task_index", "int64", "int64"), ("task", "unicode", "object"))
    ]
    index = {"index_columns": ["task"], "column_indexes": [], "columns": columns}
    metadata = {"pandas": json.dumps({**index, "pandas_version": "2.0.0"})}
    path = folder / "meta" / "tasks.parquet"
    parquet.write_table(table.replace_schema_metadata(metadata), path)


def _write_json(value: Any, file: Path) -> None:
    file.write_text(json.dumps(value, indent=2) + "\n")


def _info(features: dict[str, Any], episodes: int, frames: int, tasks: int) -> dict[str, Any]:
    return {
        "codebase_version": LAYOUT_VERSION,
        "robot_type": "lariat",
        "total_episodes": episodes,
        "total_frames": frames,
        "total_tasks": tasks,
        "chunks_size": MAX_EPISODES,
        "data_files_size_in_mb": 100,
        "video_files_size_in_mb": 500,
        "fps": FRAME_RATE,
        "splits": {"train": f"0:{episodes}"},
        "data_path": DATA_PATH,
        "video_path": None,
        "features": features,
    }
