"""Readers of files under hostile content: scenarios, node files, recordings, pictures, meshes."""

from __future__ import annotations

import os
import random
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path

import cv2
import numpy as np

from benchmarks.faults.fuzz.hostile_bytes import mutated
from benchmarks.faults.fuzz.message_targets import Totals
from lariat.configuration import ConfigurationError
from lariat.files.bounded_file import read_file
from lariat.files.image_header import check_image
from lariat.files.mesh_file import HEADER_SIZE, RECORD, read_mesh
from lariat.geometry.mesh_cover import cover_mesh
from lariat.geometry.obstacle_checks import MAX_SIZE
from lariat.scenario import Scenario, load, parse
from lariat.trajectory import SECOND
from shared.recording import Recording, Writer, copy_readable
from shared.topics import ROPE_NODES

OBJ = b"v 0 0 0\nv 0.1 0 0\nv 0 0.1 0\nv 0 0 0.1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2//1 3//1 -1//1\n"
"""Content of an OBJ file: a tetrahedron."""
MESH_BODIES, MESH_TOLERANCE = 4, 0.005
"""Most bodies of a mesh's cover [-], and how far they may stick out [m]."""


class FileTarget:
    """One reader of files, called with mutated valid files."""

    def __init__(
        self,
        name: str,
        valid: bytes,
        read: Callable[[bytes], object],
        refusal: type[Exception] = ValueError,
    ) -> None:
        """Create a target.

        Args:
            name: Name for reports.
            valid: Valid content.
            read: Reader.
            refusal: The only exception that the reader may raise.
        """
        self._name = name
        self._valid = valid
        self._read = read
        self._refusal = refusal

    def run_batch(self, seed: str, count: int, totals: Totals) -> None:
        """Read mutated contents."""
        rng = random.Random(seed)
        for _ in range(count):
            content = mutated(self._valid, rng)
            totals.messages += 1
            try:
                self._read(content)
                totals.accepted += 1
            except self._refusal:
                pass
            except Exception:
                where = traceback.format_exc(limit=-4)
                totals.failures.append(f"{self._name} {seed}: {where}")
            totals.steps += 1

    def close(self) -> None:
        """Do nothing."""


def file_targets(scenario: Scenario, folder: Path) -> dict[str, FileTarget]:
    """Create the targets."""
    angles = np.linspace(-0.5, 0.5, 46)
    arc = 0.45 * np.stack([np.sin(angles), 0.0 * angles, np.cos(angles)], axis=1)
    nodes = "\n".join(",".join(f"{x:.6f}" for x in row) for row in arc).encode()
    text = scenario.text.encode()

    def read_scenario(content: bytes) -> object:
        (folder / "a.toml").write_bytes(content)
        return load(folder / "a.toml")

    def read_nodes(content: bytes) -> object:
        (folder / "nodes.csv").write_bytes(content)
        start = '[start]\nnodes = "nodes.csv"\n[goal]\nnodes = "nodes.csv"\n'
        return parse(f'name = "f"\n[rope]\nlength = 0.45\ndiameter = 0.008\n{start}', folder)

    def read_recording(content: bytes) -> object:
        path = folder / "a.mcap"
        path.write_bytes(content)
        (folder / "b.mcap").unlink(missing_ok=True)
        copy_readable(path, folder / "b.mcap")
        return [entry.parse() for entry in Recording.open(path).messages()]

    def read_picture(content: bytes) -> object:
        (folder / "picture").write_bytes(content)
        data = read_file(folder / "picture", 2**28)
        check_image(data, 2**22)
        with _without_standard_error():
            return cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)

    def cover(name: str, content: bytes) -> object:
        (folder / name).write_bytes(content)
        triangles = read_mesh(folder / name)
        if np.max(np.ptp(triangles.reshape(-1, 3), axis=0)) > MAX_SIZE:
            raise ValueError("too large, as the command says")
        return cover_mesh(triangles, MESH_BODIES, MESH_TOLERANCE)

    picture = np.random.default_rng(0).integers(0, 255, (48, 64, 3), np.uint8)
    return {
        "scenario": FileTarget("scenario", text, read_scenario, ConfigurationError),
        "nodes": FileTarget("nodes", nodes, read_nodes, ConfigurationError),
        "recording": FileTarget("recording", _recording(scenario, folder), read_recording),
        "png": FileTarget("png", cv2.imencode(".png", picture)[1].tobytes(), read_picture),
        "jpeg": FileTarget("jpeg", cv2.imencode(".jpg", picture)[1].tobytes(), read_picture),
        "stl": FileTarget("stl", _stl(), partial(cover, "a.stl")),
        "obj": FileTarget("obj", OBJ, partial(cover, "a.obj")),
    }


def _stl() -> bytes:
    """Content of a binary STL file: a tetrahedron."""
    corners = np.array([[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.1, 0.0], [0.0, 0.0, 0.1]])
    rows = np.zeros(4, RECORD)
    rows["corners"] = corners[[[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]]
    return bytes(HEADER_SIZE - 4) + len(rows).to_bytes(4, "little") + rows.tobytes()


def _recording(scenario: Scenario, folder: Path) -> bytes:
    """Content of a small recording."""
    path = folder / "valid.mcap"
    path.unlink(missing_ok=True)
    writer = Writer(path, scenario, SECOND)
    for k in range(200):
        payload = ROPE_NODES.type(stamp=k, positions=[0.1 * k] * 6).SerializeToString()
        writer.write(ROPE_NODES, payload, "p-0", k, SECOND + k * SECOND // 100)
    writer.close()
    return path.read_bytes()


@contextmanager
def _without_standard_error() -> Iterator[None]:
    """Silence the image library, which reports every damaged image from C."""
    kept = os.dup(2)
    silence = os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(silence, 2)
        yield
    finally:
        os.dup2(kept, 2)
        os.close(kept)
        os.close(silence)
