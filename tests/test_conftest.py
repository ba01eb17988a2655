"""`-m` with or without `live` leaves out files of the other kind before they are imported."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from tests import conftest

LIVE_FILE = conftest.FOLDER / "shared" / "runtime" / "test_live.py"
COMPUTING_FILE = conftest.FOLDER / "shared" / "test_reset_counter.py"
MIXED_FILE = conftest.FOLDER / "environments" / "test_shape_control.py"
"""File with a test that is marked by hand."""


@pytest.mark.parametrize(
    ("expression", "left_out"),
    [
        ("", []),
        ("not slow", []),
        ("slow", []),
        ("live or slow", []),
        ("live and not slow", [COMPUTING_FILE]),
        ("not live and not slow", [LIVE_FILE]),
    ],
)
def test_files_of_the_other_kind_are_left_out(expression: str, left_out: list[object]) -> None:
    config: Any = SimpleNamespace(getoption=lambda name, default: expression)
    for file in (LIVE_FILE, COMPUTING_FILE, MIXED_FILE):
        ignored = conftest.pytest_ignore_collect(file, config)
        assert bool(ignored) == (file in left_out)


def test_folders_and_files_elsewhere_are_never_left_out() -> None:
    config: Any = SimpleNamespace(getoption=lambda name, default: "live and not slow")
    assert conftest.pytest_ignore_collect(conftest.FOLDER / "lariat", config) is None
    assert conftest.pytest_ignore_collect(conftest.FOLDER.parent / "lariat.py", config) is None


def test_every_live_file_exists() -> None:
    assert all((conftest.FOLDER / place).exists() for place in conftest.LIVE)
