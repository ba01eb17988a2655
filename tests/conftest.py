"""Marks the tests that run processes, sockets or clocks of their own as `live`.

Their deadlines are those of the real system: they run one after the other. All others are computed
and run in parallel (`make test`).
"""

from __future__ import annotations

from pathlib import Path

import pytest

FOLDER = Path(__file__).parent
LIVE = (
    "benchmarks/test_attacks.py",
    "benchmarks/test_faults.py",
    "benchmarks/test_machines.py",
    "browser",
    "cli/test_arm.py",
    "cli/test_held_key.py",
    "cli/test_live_stack.py",
    "cli/watch/test_watch.py",
    "compose",
    "dashboard/controls/test_stop_bar.py",
    "dashboard/web",
    "dashboard/test_service.py",
    "services/camera/test_external_publisher.py",
    "services/cr5_emulator",
    "services/recorder/test_live.py",
    "services/robot_gateway/drivers/cr5",
    "services/robot_gateway/test_process.py",
    "shared/bus/test_bus.py",
    "shared/runtime/test_live.py",
    "stack/credentials",
    "stack/launcher",
    "stack/test_approach.py",
    "stack/test_client.py",
)
"""Files and folders of live tests."""


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption(
        "--screenshots",
        type=Path,
        metavar="FOLDER",
        help="Folder for pictures of the page after each browser test, in two sizes.",
    )


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    """Leave out files none of whose tests `-m` selects: to import all takes many seconds."""
    if collection_path.suffix != ".py" or not collection_path.is_relative_to(FOLDER):
        return None
    terms = config.getoption("markexpr", "").split(" and ")
    left_out = "live" in terms and not is_live(collection_path)
    if left_out and "mark.live" in collection_path.read_text():
        # Some of its tests are marked by hand.
        return None
    left_out |= "not live" in terms and is_live(collection_path)
    return True if left_out else None


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark live tests."""
    for item in items:
        if item.path.is_relative_to(FOLDER) and is_live(item.path):
            item.add_marker(pytest.mark.live)


def is_live(path: Path) -> bool:
    """Return whether the tests of a file below `FOLDER` are live."""
    place = path.relative_to(FOLDER).as_posix()
    return any(place == live or place.startswith(f"{live}/") for live in LIVE)
