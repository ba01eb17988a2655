"""Attacks on a live stack: each is refused, and the attackers could have noticed an open door."""

from __future__ import annotations

import json
import os
import subprocess
import sys

import pytest

pytestmark = pytest.mark.live


@pytest.mark.slow
def test_nobody_else_reads_or_writes_and_a_run_reaches_its_goal_afterwards() -> None:
    command = [sys.executable, "-m", "cli", "bench", "faults", "attacks", "--json"]
    command += ["--messages", "20000"]
    said = subprocess.run(command, capture_output=True, text=True, timeout=500.0)
    assert said.stdout, said.stderr
    attacks = json.loads(said.stdout)["attacks"]
    assert [f"{each['who']}: {each['attempt']}" for each in attacks if not each["held"]] == []
    others = {each["who"] for each in attacks if not each["outcome"].startswith("left out")}
    expected = {"a process with the bus's password", "a person"}
    if os.geteuid() == 0:
        expected.add("another user of the machine")
    assert expected <= others
