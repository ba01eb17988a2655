"""`-m` with or without `live` leaves out files of the other kind before they are imported."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from tests import conftest

FOLDER = Path(conftest.__file__).parent
LIVE_FILES = [
    FOLDER / "shared" / "runtime" / "test_live.py",
    FOLDER / "browser" / "test_dashboard.py",
    FOLDER / "compose" / "test_compose.py",
]
COMPUTING_FILE = FOLDER / "shared" / "bus" / "test_message_check.py"
MIXED_FILE = FOLDER / "shared" / "ros2" / "test_real_ros.py"
"""File of whose tests some are marked."""


def test_libraries_have_the_environment_of_the_stack() -> None:
    assert not conftest.LIBRARIES_ARE_LOADED


@pytest.mark.parametrize(
    ("expression", "left_out"),
    [
        ("", []),
        ("not slow", []),
        ("slow", []),
        ("live or slow", []),
        ("live and not slow", [COMPUTING_FILE]),
        ("not live and not slow", LIVE_FILES),
    ],
)
def test_files_of_the_other_kind_are_left_out(expression: str, left_out: list[Path]) -> None:
    config: Any = SimpleNamespace(getoption=lambda name, default: expression)
    for file in (*LIVE_FILES, COMPUTING_FILE, MIXED_FILE):
        ignored = conftest.pytest_ignore_collect(file, config)
        assert bool(ignored) == (file in left_out)


def test_folders_and_files_elsewhere_are_never_left_out() -> None:
    config: Any = SimpleNamespace(getoption=lambda name, default: "live and not slow")
    assert conftest.pytest_ignore_collect(FOLDER / "lariat", config) is None
    assert conftest.pytest_ignore_collect(FOLDER.parent / "lariat.py", config) is None
