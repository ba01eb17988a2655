"""Attribution of sampled call stacks to the stages of the loop."""

from __future__ import annotations

import ast
import json
from pathlib import Path

import pytest

from benchmarks.speed.stages import stages
from benchmarks.speed.stages.sampling import read
from benchmarks.speed.stages.stages import OUTSIDE, Frame, Sample, Stage, times, within

ROOT = Path(__file__).parents[4]
LOOP = Frame("/clone/stack/simulation/simulated_time.py", "_step")
SERVICE = Frame("/clone/services/controller/service.py", "step")
PLAN = Frame("/clone/lariat/control/mpc/gauss_newton.py", "plan")
KERNEL = Frame("/clone/lariat/rod/rod.py", "linearize")


@pytest.mark.parametrize("place", stages._BY_FUNCTION)
def test_every_named_function_exists(place: str) -> None:
    path, _, name = place.rpartition(":")
    tree = ast.parse((ROOT / path).read_text())
    assert name in {n.name for n in ast.walk(tree) if isinstance(n, ast.FunctionDef)}


@pytest.mark.parametrize("place", [stages._RECEIVE, stages._PUBLISH])
def test_bus_has_the_functions_that_are_counted(place: str) -> None:
    test_every_named_function_exists(place)


def test_a_sample_counts_for_the_innermost_stage() -> None:
    found = times(
        [
            Sample((LOOP, SERVICE, PLAN, KERNEL), 0.2),
            Sample((LOOP, SERVICE, PLAN), 0.1),
            Sample((LOOP, SERVICE), 0.05),
            Sample((LOOP,), 0.01),
        ]
    )
    assert found == {
        Stage("controller", "horizon", "step"): pytest.approx(0.3),
        Stage("controller", "rest", "step"): 0.05,
        OUTSIDE: 0.01,
    }


def test_what_a_live_process_does_beside_its_stages_is_its_rest() -> None:
    put = Frame("/clone/shared/bus/publisher.py", "put")
    found = times([Sample((put,), 0.3), Sample((LOOP, KERNEL), 0.2)], "recorder")
    assert found == {
        Stage("recorder", "publish", "step"): 0.3,
        Stage("recorder", "rest", "step"): 0.2,
    }


def test_samples_outside_of_a_function_are_left_out() -> None:
    inside, outside = Sample((LOOP, SERVICE), 1.0), Sample((KERNEL,), 1.0)
    assert within([inside, outside], "stack/simulation/simulated_time.py:_step") == [inside]


@pytest.mark.parametrize(
    "innermost",
    [
        {"name": "Condition.wait", "file": "/usr/lib/python3.11/threading.py"},
        {"name": "EpollSelector.select", "file": "/usr/lib/python3.11/selectors.py"},
        {"name": "_worker", "file": "/usr/lib/python3.11/concurrent/futures/thread.py"},
        {"name": "_keep_pace", "file": "/lariat/shared/runtime/live.py"},
    ],
)
def test_threads_that_wait_count_for_nothing(tmp_path: Path, innermost: dict[str, str]) -> None:
    frames = [{"name": "run", "file": "/lariat/shared/runtime/live.py"}, innermost]
    profile = {"samples": [[0, 1], [0], []], "weights": [0.005, 0.01, 0.02]}
    file = tmp_path / "profile.json"
    file.write_text(json.dumps({"shared": {"frames": frames}, "profiles": [profile]}))
    assert read(file) == [Sample((Frame("/lariat/shared/runtime/live.py", "run"),), 0.01)]


def test_a_profile_is_read_without_the_classes_of_methods(tmp_path: Path) -> None:
    file = tmp_path / "profile.json"
    file.write_text(
        json.dumps(
            {
                "shared": {
                    "frames": [{"name": "Loop._step", "file": "a.py"}, {"name": "<native>"}]
                },
                "profiles": [{"samples": [[0, 1], [0]], "weights": [0.005, 0.01]}],
            }
        )
    )
    loop, native = Frame("a.py", "_step"), Frame("", "<native>")
    assert read(file) == [Sample((loop, native), 0.005), Sample((loop,), 0.01)]
