from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from cli import check
from cli.__main__ import main
from lariat.arms.description import CR5_URDF
from lariat.configuration import ConfigurationError
from lariat.geometry import polylines
from lariat.planning import cell_problem as planning
from lariat.planning import preflight
from lariat.planning.moving_obstacles import Departure
from lariat.planning.problem import Problem
from lariat.planning.shorter_path import stay
from lariat.scenario import Scenario
from lariat.scenario.entries import inline
from lariat.scenario.settings import load_with
from lariat.simulation.rest_shape import rest_shape
from services.robot_gateway.drivers.factory import drivers_of


def test_a_plan_is_part_of_the_check(capsys: pytest.CaptureFixture[str]) -> None:
    assert check.main(Path("three-cylinders"), plan=True, json=True) == 0
    found = json.loads(capsys.readouterr().out)["plan"]
    assert found["reached"]
    assert found["clearance_mm"] > 7.0
    assert found["final_error_mm"] < 0.5


def test_plan_says_what_is_certain_of_its_clearance_where_the_rope_is_to_be_learned(
    capsys: pytest.CaptureFixture[str],
) -> None:
    known = check.planned(load_with("three-cylinders", ()))
    assert known["certain_clearance_mm"] == known["clearance_mm"]
    assert check.main(Path("three-cylinders"), plan=True, set=("control.adapt=true",)) == 0
    pattern = r"([\d.]+) mm from obstacles, with 99 % (-?[\d.]+) mm\s"
    words = re.search(pattern, capsys.readouterr().out)
    assert words is not None
    assert float(words[2]) < float(words[1]) - 5.0


def test_check_tells_how_far_a_goal_is_from_a_rest_shape(
    capsys: pytest.CaptureFixture[str],
) -> None:
    rest = rest_shape(load_with(Path("three-cylinders"), ["plant.model=rod"]))
    wave = 0.02 * np.sin(np.linspace(0.0, 2.0 * np.pi, len(rest)))
    distances = []
    for shape in (rest, rest + wave[:, None] * [0.0, 1.0, 0.0]):
        goal = f"goal={{nodes={inline(shape.tolist())}}}"
        assert check.main(Path("three-cylinders"), json=True, set=(goal,)) == 0
        distances.append(json.loads(capsys.readouterr().out)["rest_distance_mm"]["goal"])
    assert distances[0] < 0.1
    assert 5.0 < distances[1] < 8.0


@pytest.mark.parametrize("few", [10, 40])
def test_check_tells_how_far_a_rope_of_few_nodes_hangs_from_one_of_many(
    few: int, capsys: pytest.CaptureFixture[str]
) -> None:
    """A rope of 20 m hangs in a bend that is narrower than an edge of forty nodes."""
    long = ["rope.length=20", "limits.workspace=[[-15, -15, 0], [15, 15, 19]]"]
    for shape in ("start", "goal"):
        long += [f"{shape}.line=[[-0.5, 0, 12], [0.5, 0, 12]]"]
    settings = (f"rope.node_count={few}", "run.tolerance=0.001", *(long if few == 40 else []))
    scenario = load_with(Path("three-cylinders"), settings)
    many = replace(scenario, rope=replace(scenario.rope, node_count=16 * (few - 1) + 1))
    coarse, fine = (preflight._at_rest(each, "start", each.start) for each in (scenario, many))
    error = 1e3 * np.linalg.norm(fine - polylines.resample(coarse, len(fine)), axis=1).max()
    assert check.main(Path("three-cylinders"), json=True, set=settings) == 0
    estimate = json.loads(capsys.readouterr().out)["resolution_mm"]["start"]
    assert error < estimate < 1.15 * error
    assert check.main(Path("three-cylinders"), set=settings) == 0
    assert f"start: {few} nodes" in capsys.readouterr().out


def test_alternatives_are_listed(capsys: pytest.CaptureFixture[str]) -> None:
    assert check.main(Path("three-cylinders"), plan=True, alternatives=2) == 0
    listed = [line for line in capsys.readouterr().out.splitlines() if "grips travel" in line]
    assert 1 <= len(listed) <= 2
    assert listed[0].startswith("  path 1: ")


def test_check_writes_the_nearest_shape_where_no_path_leads_to_the_goal(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def blocked(scenario: Scenario, problem: Problem) -> Departure:
        return Departure(stay(problem, "blocked: a wall"), 0.0, np.inf)

    monkeypatch.setattr(planning, "scenario_departure", blocked)
    file = tmp_path / "near.csv"
    assert check.main(Path("three-cylinders"), plan=True, nearest=file) == 1
    assert str(file) in capsys.readouterr().out
    left = np.loadtxt(file, delimiter=",")[0]
    line = load_with(Path("three-cylinders"), ()).start.line
    assert line is not None
    assert left == pytest.approx(line[0], abs=1e-6)


@pytest.mark.parametrize("plan", [(), ("--plan",)])
@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"urdf": f'"{CR5_URDF}"', "base_position": "[3, 0, 0]"}, "out of the arm's reach"),
        ({"urdf": '"none.urdf"'}, "none.urdf"),
        ({"urdf": f'"{CR5_URDF}"', "flange": '"hand"'}, "no link 'hand'"),
        ({"urdf": f'"{CR5_URDF}"', "flange": '"base_link"'}, "moves 'base_link'"),
        ({"driver": '"nowhere:Arm"'}, "no module 'nowhere'"),
    ],
    ids=["reach", "file", "flange", "base", "class"],
)
def test_check_refuses_what_the_gateway_refuses(
    changes: dict[str, str], told: str, plan: tuple[str, ...], capsys: pytest.CaptureFixture[str]
) -> None:
    values = {"driver": '"simulated"', "flange": '"link_6"', **changes}
    settings = [w for k, v in values.items() for w in ("--set", f"ends.right.{k}={v}")]
    assert main(["check", "fixed-end", *plan, *settings]) == 2
    assert told in capsys.readouterr().err
    scenario = load_with("fixed-end", tuple(settings[1::2]))
    with pytest.raises(ConfigurationError, match=re.escape(told)):
        drivers_of(scenario, scenario.grips(scenario.start), {}, {})


@pytest.mark.parametrize("key", ["control.method", "control.path_planner", "sensing.method"])
def test_a_class_from_outside_that_is_missing_is_refused(
    key: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["check", "rope", "--set", f"{key}=nowhere:Class"]) == 2
    assert f"{key} = 'nowhere:Class': no module 'nowhere'" in capsys.readouterr().err


@pytest.mark.parametrize("turn", ["[0, 0, 0, 0]", "[0, 0, 180, 0]"])
def test_a_quaternion_that_is_none_is_refused(
    turn: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["check", "fixed-end", "--set", f"ends.right.base_orientation={turn}"]) == 2
    assert "ends.right.base_orientation" in capsys.readouterr().err
