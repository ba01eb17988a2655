from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from cli.__main__ import main
from lariat.geometry import polylines
from tests.closed_loop.loop import SCENARIOS


def test_a_shape_is_a_goal_of_the_scenario_that_it_was_made_for(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "goal.csv"
    right = ["--right", "0.10", "0.15", "0.25"]
    coarse = ["--set", "plant.rope.node_count=40"]
    made = ["shape", str(SCENARIOS / "fixed-end.toml"), *right, *coarse, "--output", str(file)]
    assert main([*made, "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["node_count"] == 40
    nodes = np.loadtxt(file, delimiter=",")
    np.testing.assert_allclose(nodes[-1], [0.10, 0.15, 0.25], atol=1e-6)
    assert polylines.length(nodes) == pytest.approx(0.45, rel=1e-3)
    assert "--right 0.1 0.15 0.25" in file.read_text().splitlines()[0]


def test_grips_that_the_rope_cannot_join_are_refused_in_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "goal.csv"
    far = ["--right", "0.9", "0.0", "0.3", "--output", str(file)]
    assert main(["shape", str(SCENARIOS / "fixed-end.toml"), *far]) == 2
    assert "closer together" in capsys.readouterr().err
    assert not file.exists()
