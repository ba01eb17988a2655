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
