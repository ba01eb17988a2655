from __future__ import annotations

import subprocess
import sys

import pytest


@pytest.mark.parametrize(
    "arguments",
    [("--help",), ("check", "--help"), ("check", "three-cylinders", "--json"), ("bench", "--help")],
)
def test_a_command_ends_without_a_traceback_when_its_reader_has_ended(
    arguments: tuple[str, ...],
) -> None:
    command = [sys.executable, "-m", "cli", *arguments]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        process.stdout.close()
        errors = process.stderr.read().decode()
    assert process.returncode == 141
    assert "Error" not in errors
