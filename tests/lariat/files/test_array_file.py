"""Arrays of files take no more room than is allowed, whatever their headers claim."""

from __future__ import annotations

import io
import tracemalloc
import zipfile
from pathlib import Path

import numpy as np
import pytest

from lariat.files.array_file import read_array, read_arrays


def header(shape: tuple[int, ...]) -> bytes:
    """Begin of an NPY file of numbers."""
    stream = io.BytesIO()
    claimed = {"descr": "<f8", "fortran_order": False, "shape": shape}
    np.lib.format.write_array_header_1_0(stream, claimed)
    return stream.getvalue()


def test_array_is_read_back(tmp_path: Path) -> None:
    values = np.arange(6.0).reshape(2, 3)
    np.savez_compressed(tmp_path / "a.npz", a=values, b=3)
    b, a = read_arrays(tmp_path / "a.npz", ("b", "a"), 48)
    assert b == 3
    assert np.array_equal(a, values)
    with pytest.raises(KeyError, match="'c', \\['a', 'b'\\]"):
        read_arrays(tmp_path / "a.npz", ("c",), 48)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (header((30 * 10**12,)), "claims shape"),
        (header((-1, 8)), "claims shape"),
        (header((4,)), "array data"),
        (b"", "magic"),
        (b"\x93NUMPY\x09\x00", "EOF"),
    ],
    ids=["terabytes", "negative", "cut", "empty", "version"],
)
def test_array_that_claims_too_much_or_is_cut_is_refused(content: bytes, words: str) -> None:
    with pytest.raises((ValueError, EOFError), match=words):
        read_array(io.BytesIO(content), 2**20)


def test_zeros_that_unpack_to_gigabytes_are_not_unpacked(tmp_path: Path) -> None:
    path, block = tmp_path / "zeros.npz", bytes(2**20)
    with (
        zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive,
        archive.open("a.npy", "w") as file,
    ):
        file.write(header((2**25,)))
        for _ in range(2**8):
            file.write(block)
    assert path.stat().st_size < 2**19
    tracemalloc.start()
    with pytest.raises(ValueError, match="more than 1 MiB"):
        read_arrays(path, ("a",), 2**20)
    assert tracemalloc.get_traced_memory()[1] < 2**22
    tracemalloc.stop()


def test_object_array_and_damaged_archive_are_refused(tmp_path: Path) -> None:
    np.savez(tmp_path / "objects.npz", a=np.array([{}], dtype=object))
    with pytest.raises(ValueError, match="allow_pickle"):
        read_arrays(tmp_path / "objects.npz", ("a",), 2**20)
    (tmp_path / "text.npz").write_text("no archive")
    with pytest.raises(ValueError, match="zip"):
        read_arrays(tmp_path / "text.npz", ("a",), 2**20)
