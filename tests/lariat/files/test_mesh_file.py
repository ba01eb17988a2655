"""STL and OBJ files of one mesh give the same triangles; other files are refused."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest

from lariat.files import mesh_file
from lariat.files.mesh_file import read_mesh

CORNERS = [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 2.0, 0.0), (0.0, 2.0, 0.5)]
TRIANGLES = np.array([[CORNERS[0], CORNERS[1], CORNERS[2]], [CORNERS[0], CORNERS[2], CORNERS[3]]])
QUAD = "f 1/1/1 2/1/1 3/1/1 4/1/1"


def binary_stl() -> bytes:
    records = b"".join(struct.pack("<12fH", 0, 0, 1, *t.ravel(), 0) for t in TRIANGLES)
    # A binary file may begin with the word of the text format.
    return b"solid of a program".ljust(80) + struct.pack("<I", len(TRIANGLES)) + records


def text_stl() -> bytes:
    facets = [
        "facet normal 0 0 1\n outer loop\n"
        + "".join(f"  vertex {x} {y} {z}\n" for x, y, z in triangle)
        + " endloop\nendfacet\n"
        for triangle in TRIANGLES
    ]
    return f"solid plate\n{''.join(facets)}endsolid plate\n".encode()


def obj(face: str = QUAD) -> bytes:
    vertices = "".join(f"v {x} {y} {z}\n" for x, y, z in CORNERS)
    return f"# a plate\n{vertices}vn 0 0 1\n\n{face}\n".encode()


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("plate.stl", binary_stl()),
        ("plate.stl", binary_stl() + bytes(7)),
        ("plate.STL", text_stl()),
        ("plate.obj", obj()),
        ("plate.obj", obj("f -4 -3 -2 -1") + b"v 9 9 9\n"),
        ("plate.stl", b"\xef\xbb\xbf" + text_stl().replace(b"plate", b"Tr\xe4ger").upper()),
        ("plate.obj", obj("f 1 2 \\\r\n 3 4")),
        ("plate.stl", text_stl().decode().replace(".", ",").encode("utf-16")),
    ],
    ids=[
        "binary",
        "longer binary",
        "text",
        "obj",
        "backwards",
        "capitals",
        "continued",
        "utf-16 with commas",
    ],
)
def test_files_of_one_mesh_are_the_same(tmp_path: Path, name: str, content: bytes) -> None:
    (tmp_path / name).write_bytes(content)
    np.testing.assert_allclose(read_mesh(tmp_path / name), TRIANGLES)


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("plate.step", b"", "give a mesh as .stl or .obj"),
        ("plate.stl", b"ply\nformat ascii 1.0\n", "is a mesh in PLY format; give a mesh as .stl"),
        ("plate.dae", b"<?xml version='1.0'?>", "is a mesh in COLLADA format; give a mesh as"),
        ("plate.obj", b"version https://git-lfs.github.com/spec/v1\n", "`git lfs pull` fetches"),
        ("plate.stl", binary_stl()[:-3], "is damaged or no STL file: 2 triangles by its header"),
        ("plate.stl", text_stl()[:-20], "is damaged: it ends before 'endsolid'"),
        ("plate.stl", b"nothing of a mesh", "is no STL file: as a text it would begin with"),
        ("plate.stl", text_stl().replace(b"2.0", b"x"), "'1.0 x 0.0' is no point x y z"),
        ("plate.obj", obj("f 1 2 x"), "a face names 'x', which is no vertex"),
        ("plate.stl", b"solid empty\nendsolid\n", "no triangle"),
        ("plate.stl", text_stl().replace(b"2.0", b"nan"), "not finite"),
        ("plate.obj", obj("f " + 2000 * "1 2 3 "), "a line has 12001 bytes, more than 4096"),
        ("plate.stl", b"solid " + 5000 * b"x", "a line has 5006 bytes"),
        ("plate.obj", obj("f 1 2 5"), "vertex 5 of 4"),
        ("plate.obj", obj("f 0 1 2"), "vertex 0 of 4"),
    ],
)
def test_other_files_are_refused(tmp_path: Path, name: str, content: bytes, words: str) -> None:
    (tmp_path / name).write_bytes(content)
    with pytest.raises(ValueError, match=words):
        read_mesh(tmp_path / name)


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("plate.stl", binary_stl()),
        ("plate.stl", text_stl() + b"vertex x"),
        ("plate.obj", obj() + b"f x"),
        ("plate.obj", 9 * b"v 0 0 0\n" + b"v x"),
    ],
    ids=["binary", "text", "faces", "vertices"],
)
def test_reading_ends_at_the_largest_number_of_triangles(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, name: str, content: bytes
) -> None:
    monkeypatch.setattr(mesh_file, "MAX_TRIANGLES", 1)
    (tmp_path / name).write_bytes(content)
    # The end is no number: nobody may get there.
    with pytest.raises(ValueError, match="more than 1 triangles"):
        read_mesh(tmp_path / name)
