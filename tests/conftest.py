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
    "dashboard/door",
    "dashboard/test_service.py",
    "services/camera/test_external_publisher.py",
    "services/cr5_emulator",
    "services/recorder/test_live.py",
    "services/robot_gateway/drivers/cr5",
    "services/robot_gateway/test_process.py",
    "shared/test_bus.py",
    "shared/test_live.py",
    "stack/credentials",
    "stack/launcher",
    "stack/test_approach.py",
    "stack/test_client.py",
)
"""Files and folders of live tests."""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    for item in items:
        if not item.path.is_relative_to(FOLDER):
            continue
        place = item.path.relative_to(FOLDER).as_posix()
        if any(place == live or place.startswith(f"{live}/") for live in LIVE):
            item.add_marker(pytest.mark.live)
