from __future__ import annotations

import subprocess
import sys

import pytest


@pytest.mark.parametrize(
    "arguments",
    [
        ("cli", "--help"),
        ("cli", "check", "--help"),
        ("cli", "check", "three-cylinders", "--json"),
        ("cli", "bench", "--help"),
        ("services.planner", "--help"),
        ("services.cr5_emulator", "--list-faults"),
        ("shared.bus.router", "--help"),
    ],
)
def test_a_command_ends_without_a_traceback_when_its_reader_has_ended(
    arguments: tuple[str, ...],
) -> None:
    command = [sys.executable, "-m", *arguments]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        process.stdout.close()
        errors = process.stderr.read().decode()
    assert process.returncode == 141
    assert "Error" not in errors
