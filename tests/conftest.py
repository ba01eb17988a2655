"""Option of the browser tests, environment, and a shortcut past files whose tests `-m` leaves out.

Tests with deadlines of the real system are marked `live` and run one after the other. All others
run in parallel; of pages in browsers, one by one.
"""

from __future__ import annotations

import os
import re
import sys
from pathlib import Path

import pytest

from stack.launcher.library_environment import LIBRARY_ENVIRONMENT

LIBRARIES_ARE_LOADED = "numpy" in sys.modules
"""Whether it is too late for the environment, which libraries read when they load."""
# A thread per core in each library takes twice the processor time, and parallel tests wait for it.
os.environ.update(LIBRARY_ENVIRONMENT)

LIVE_FILE = re.compile(r"^pytestmark = \[?\s*pytest\.mark\.live\b", re.M)
"""Statement that marks all tests of a file."""


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption(
        "--screenshots",
        type=Path,
        metavar="FOLDER",
        help="Folder for pictures of the page after each browser test, in two sizes.",
    )


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    """Leave out files none of whose tests `-m` selects: to import all takes many seconds."""
    terms = config.getoption("markexpr", "").split(" and ")
    if not collection_path.match("test_*.py") or not {"live", "not live"} & set(terms):
        return None
    text = collection_path.read_text()
    if LIVE_FILE.search(text):
        return True if "not live" in terms else None
    return True if "live" in terms and "mark.live" not in text else None
