"""Small regular files are read; everything else is refused without waiting for it."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from lariat.files.bounded_file import path_inside, read_file


def test_file_within_the_limit_is_read(tmp_path: Path) -> None:
    (tmp_path / "a").write_bytes(b"12345")
    (tmp_path / "link").symlink_to(tmp_path / "a")
    assert read_file(tmp_path / "a", 5) == read_file(tmp_path / "link", 5) == b"12345"
    with pytest.raises(ValueError, match="larger than"):
        read_file(tmp_path / "a", 4)


def test_device_pipe_and_folder_are_refused(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    for path in (Path("/dev/zero"), tmp_path / "pipe", tmp_path):
        with pytest.raises(ValueError, match="not a regular file"):
            read_file(path, 5)


def test_missing_file_is_an_error_of_the_system(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError):
        read_file(tmp_path / "a", 5)


def test_links_in_a_circle_are_an_error_of_the_system(tmp_path: Path) -> None:
    (tmp_path / "a").symlink_to("b")
    (tmp_path / "b").symlink_to("a")
    with pytest.raises(OSError, match="symbolic links"):
        path_inside(tmp_path, "a").stat()
    with pytest.raises(OSError, match="symbolic links"):
        read_file(tmp_path / "a", 5)


def test_name_leads_to_a_file_of_the_folder_only(tmp_path: Path) -> None:
    folder = tmp_path / "cell"
    folder.mkdir()
    (folder / "out").symlink_to("/dev")
    assert path_inside(folder, "goals/a.csv") == folder / "goals" / "a.csv"
    for name in ("/dev/zero", "../a.csv", "goals/../../a.csv", "out/zero", "a\0.csv"):
        with pytest.raises(ValueError, match="outside of"):
            path_inside(folder, name)
