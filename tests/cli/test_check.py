from __future__ import annotations

import json
from pathlib import Path

import pytest

from cli import check


def test_a_plan_is_part_of_the_check(capsys: pytest.CaptureFixture[str]) -> None:
    assert check.main(Path("three-cylinders"), plan=True, json=True) == 0
    found = json.loads(capsys.readouterr().out)["plan"]
    assert found["reached"]
    assert found["clearance_mm"] > 7.0
    assert found["final_error_mm"] < 0.5


def test_alternatives_are_listed(capsys: pytest.CaptureFixture[str]) -> None:
    assert check.main(Path("three-cylinders"), plan=True, alternatives=2) == 0
    listed = [line for line in capsys.readouterr().out.splitlines() if "grips travel" in line]
    assert 1 <= len(listed) <= 2
    assert listed[0].startswith("  path 1: ")
