"""What a process does not import, since its start would take longer by it."""

from __future__ import annotations

import subprocess
import sys

import pytest


@pytest.mark.parametrize(
    ("module", "library"),
    [
        ("services.robot_gateway.service", "lariat.rod"),
        ("services.recorder.service", "lariat.rod"),
    ],
)
def test_a_process_starts_without_what_it_does_not_need(module: str, library: str) -> None:
    code = f"import sys, {module}; print({library!r} in sys.modules)"
    answer = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert answer.stdout == "False\n"
