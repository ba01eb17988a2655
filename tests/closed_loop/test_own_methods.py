"""Classes from outside in the closed loop: those of the guide reach goals, faulty ones hold."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from lariat.scenario.settings import load_with
from shared import topics
from shared.messages import FAILED, ArmStates, TaskState
from stack.simulation import closed_loop
from stack.simulation.closed_loop import RunOutcome
from stack.simulation.simulated_time import Delivery
from tests.closed_loop.loop import SCENARIOS
from tests.own_method_examples import write_examples

EASY = (
    "sensing.source=truth",
    "obstacles=[]",
    "plant.model=rod",
    "goal.line=[[-0.19, -0.02, 0.32], [0.19, -0.02, 0.34]]",
    "run.time_limit=5.0",
)
"""Goal without obstacles, 10 cm from the start, on a plant with three times the model's edges."""
FAULTY = """
import numpy as np

class Faulty:
    def __init__(self, setup):
        self.calls = 0

    def reset(self):
        pass

    def velocity(self, state):
        self.calls += 1
        if self.calls < 20:
            return np.array([[0.0, 0.1, 0.0, 0.0, 0.0, 0.0]] * 2)
        return self.fail()

class Raises(Faulty):
    def fail(self):
        raise ZeroDivisionError("gain")

class AnswersNan(Faulty):
    def fail(self):
        return np.full((2, 6), np.nan)

class ForgetsRope:
    def __init__(self, setup):
        self.calls = 0

    def reset(self, time, grips, nodes):
        self.nodes = nodes

    def estimate(self, time, grips, observation):
        self.calls += 1
        return self.nodes if self.calls < 200 else np.zeros((0, 3))

class Unsure:
    def __init__(self, setup):
        pass

    def plan(self, problem):
        raise LookupError("no map")
"""


@pytest.fixture(autouse=True)
def own_modules(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write_examples(tmp_path)
    (tmp_path / "faulty_methods.py").write_text(FAULTY)
    monkeypatch.syspath_prepend(str(tmp_path))


def run(*settings: str, taps=(), stop_after: float | None = None) -> RunOutcome:
    scenario = load_with(SCENARIOS / "three-cylinders.toml", (*EASY, *settings))
    return closed_loop.run(scenario, taps=taps, stop_after=stop_after)


def test_the_controller_and_the_estimator_of_the_guide_reach_an_easy_goal():
    outcome = run(
        "control.method=shape_servo:ShapeServo",
        "control.state_estimator=carried:Carried",
        "control.planner=false",
    )
    assert outcome.score.reached, outcome.reason
    assert outcome.score.final_error_mm is not None
    assert outcome.score.final_error_mm < 5.0


def test_the_planner_of_the_guide_reaches_the_goal_behind_the_cylinders():
    scenario = load_with(
        SCENARIOS / "three-cylinders.toml",
        ("sensing.source=truth", "plant.model=rod", "control.path_planner=lift:Lift"),
    )
    outcome = closed_loop.run(scenario, stop_after=0.2)
    assert outcome.score.reached, outcome.reason
    assert outcome.score.contact_time_s == 0.0
    assert outcome.score.min_clearance_mm is not None
    assert outcome.score.min_clearance_mm > 5.0


@pytest.mark.parametrize(
    ("key", "name", "blame"),
    [
        ("method", "Raises", "velocity() raised ZeroDivisionError: gain (faulty_methods.py:"),
        ("method", "AnswersNan", "velocity() answered a number that is not finite"),
        ("state_estimator", "ForgetsRope", "answered an array of shape (0, 3), not (40, 3)"),
        ("path_planner", "Unsure", "plan() raised LookupError: no map"),
    ],
)
def test_a_faulty_class_holds_the_arms_and_is_named(key: str, name: str, blame: str):
    arms: list[ArmStates] = []
    tasks: list[TaskState] = []

    def listen(delivery: Delivery) -> None:
        if delivery.key == topics.ARM_STATE.key:
            arms.append(delivery.parse())
        if delivery.key == topics.TASK_STATE.key:
            tasks.append(delivery.parse())

    planned = "true" if key == "path_planner" else "false"
    outcome = run(
        f"control.{key}=faulty_methods:{name}", f"control.planner={planned}", taps=(listen,)
    )
    assert f"control.{key} 'faulty_methods:{name}'" in outcome.reason
    assert blame in outcome.reason
    assert tasks[-1].state == FAILED
    # It moved until the fault, and comes to rest within the time that braking from 0.1 m/s takes.
    fault = next(task.stamp for task in tasks if task.state == FAILED)
    outcome.stack.advance_to(outcome.stack.now + 600_000_000)
    late = [state for state in arms if state.stamp > fault + 500_000_000]
    assert late
    speeds = [np.linalg.norm(arm.linear_velocity) for state in late for arm in state.arms]
    assert max(speeds) == 0.0
    if key == "method":
        assert max(np.linalg.norm(a.linear_velocity) for s in arms for a in s.arms) > 0.05
