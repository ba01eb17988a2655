from __future__ import annotations

import json

import pytest

from benchmarks import policies


def test_bench_compares_a_trained_policy_with_the_straight_way(
    capsys: pytest.CaptureFixture[str],
) -> None:
    code = policies.run(
        scene=("easy",), plant="rod", plant_nodes=40, count=1, iterations=1, goals=2, json=True
    )
    answer = json.loads(capsys.readouterr().out)
    assert set(answer["summary"]) == {"easy, straight", "easy, trained"}
    straight = answer["summary"]["easy, straight"]
    assert straight["within 5 mm"] == 1
    assert straight["largest error [mm]"] < 2.0
    trained = answer["summary"]["easy, trained"]
    assert code == (0 if trained["within 5 mm, untouched"] == 1 else 1)
    assert len(answer["episodes"]["easy, trained"]) == 1
