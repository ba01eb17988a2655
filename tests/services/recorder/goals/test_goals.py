"""Named goals of the recorder: what is kept, what is refused."""

from __future__ import annotations

import logging
from pathlib import Path

import numpy as np
import pytest

from lariat.geometry.poses import Pose
from lariat.scenario import Shape, load
from lariat.scenario.goal_table import read_entry
from lariat.trajectory import SECOND
from services.recorder.goals.goal_folder import MAX_GOALS
from services.recorder.goals.goals import Goals
from shared.door import Door
from shared.messages import Goal, GoalList, GoalListRequest, grip

SCENARIO = load("three-cylinders")
NODES = np.linspace([0.0, 0.0, 0.1], [0.45, 0.0, 0.123456], 40)
GOAL = Goal(
    positions=NODES.ravel(),
    left=grip(Pose(NODES[0], np.array([1.0, 0.0, 0.0, 0.0]))),
    right=grip(Pose(NODES[-1], np.array([0.0, 1.0, 0.0, 0.0]))),
    left_oriented=True,
    turns=2.0,
)


class Recorder:
    """Goals of a folder, asked one thing after the other."""

    def __init__(self, folder: Path) -> None:
        self.goals = Goals(SCENARIO, folder, Door())
        self.goals.load()
        self.now = SECOND

    def ask(self, action: GoalListRequest.Action, name: str, goal: Goal | None = GOAL) -> GoalList:
        self.now += SECOND // 10
        request = GoalListRequest(id="a-1", action=action, name=name, goal=goal)
        answer = self._step(request)
        assert answer.last_request == "a-1"
        return answer

    def listed(self) -> GoalList:
        self.now += SECOND
        return self._step()

    def _step(self, *requests: GoalListRequest) -> GoalList:
        (publication,) = self.goals.step(requests, self.now)
        assert isinstance(publication.message, GoalList)
        return publication.message


def test_goal_is_kept_whole_across_a_new_start(tmp_path: Path) -> None:
    folder = tmp_path / "recordings"
    assert not Recorder(folder).ask(GoalListRequest.SAVE, "arch").refusal
    (saved,) = Recorder(folder).listed().goals
    assert (saved.name, saved.scenario, saved.goal) == ("arch", "three-cylinders", GOAL)
    assert (folder / "goals").stat().st_mode & 0o077 == 0


def test_goal_s_nodes_are_a_table_as_scenarios_take_it(tmp_path: Path) -> None:
    Recorder(tmp_path).ask(GoalListRequest.SAVE, "arch")
    file = tmp_path / "goals" / "arch.csv"
    assert np.loadtxt(file, delimiter=",") == pytest.approx(NODES, abs=1e-6)
    shape = Shape(nodes="arch.csv", left_orientation=(1.0, 0.0, 0.0, 0.0), turns=2.0)
    assert read_entry(file.read_text()) == shape


def test_list_is_published_once_a_second(tmp_path: Path) -> None:
    recorder = Recorder(tmp_path)
    assert list(recorder.listed().goals) == []
    assert list(recorder.goals.step([], recorder.now + SECOND // 2)) == []


def test_deleted_goal_leaves_no_file(tmp_path: Path) -> None:
    recorder = Recorder(tmp_path)
    recorder.ask(GoalListRequest.SAVE, "arch")
    assert not recorder.ask(GoalListRequest.DELETE, "arch").goals
    assert list((tmp_path / "goals").iterdir()) == []
    assert "no goal" in recorder.ask(GoalListRequest.DELETE, "arch").refusal


@pytest.mark.parametrize("name", ["", "../x", "A", "a/b", "a.b", "a" * 41])
def test_bad_name_is_refused(tmp_path: Path, name: str) -> None:
    assert "no name" in Recorder(tmp_path).ask(GoalListRequest.SAVE, name).refusal
    assert not (tmp_path / "goals").exists()


def test_goals_are_bounded_and_a_known_one_is_replaced(tmp_path: Path) -> None:
    recorder = Recorder(tmp_path)
    for k in range(MAX_GOALS):
        assert not recorder.ask(GoalListRequest.SAVE, f"g{k}").refusal
    assert "delete one first" in recorder.ask(GoalListRequest.SAVE, "more").refusal
    other = Goal(positions=[0.0] * 6)
    answer = recorder.ask(GoalListRequest.SAVE, "g3", other)
    assert {s.name: s.goal for s in answer.goals}["g3"] == other
    assert "no nodes" in recorder.ask(GoalListRequest.SAVE, "g3", Goal()).refusal


@pytest.mark.parametrize(
    "text", ["{", '{"name": "other"}', '{"name": "x", "goal": {"positions": [1e9, 0, 0]}}']
)
def test_file_that_is_no_goal_is_left_out(
    tmp_path: Path, text: str, caplog: pytest.LogCaptureFixture
) -> None:
    Recorder(tmp_path).ask(GoalListRequest.SAVE, "arch")
    (tmp_path / "goals" / "x.json").write_text(text)
    with caplog.at_level(logging.WARNING):
        assert [saved.name for saved in Recorder(tmp_path).listed().goals] == ["arch"]
    assert "x.json" in caplog.text
