"""Classes from outside: how they are found, guarded and refused."""

from __future__ import annotations

from dataclasses import replace
from importlib.metadata import EntryPoint
from pathlib import Path

import numpy as np
import pytest

from lariat.configuration import ConfigurationError
from lariat.scenario import Scenario, extensions, load
from lariat.scenario.extensions import Extension, ExtensionFault, extensions_of, require_allowed
from lariat.scenario.sections import CONTROL_METHODS

MODULE = """
class Good:
    def __init__(self, setup):
        self.setup = setup

    def reset(self):
        raise KeyError("left")

class Picky(Good):
    def __init__(self, setup):
        raise ValueError("wants a GPU")

SOMETHING = 3
"""


@pytest.fixture(autouse=True)
def module(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "outside.py").write_text(MODULE)
    (tmp_path / "broken.py").write_text("import nothing_of_this_name\n")
    (tmp_path / "raising.py").write_text("1 / 0\n")
    monkeypatch.syspath_prepend(str(tmp_path))


def own(name: str) -> Extension:
    return Extension("control.method", name, CONTROL_METHODS)


def test_a_class_is_found_by_module_and_name():
    assert own("outside:Good").create(("reset",), 7).setup == 7


def test_a_class_is_found_by_its_entry_point(monkeypatch: pytest.MonkeyPatch):
    point = EntryPoint("good", "outside:Good", "lariat.controllers")
    monkeypatch.setattr(
        extensions, "entry_points", lambda group, name: [point] if name == "good" else []
    )
    assert own("good").load().__name__ == "Good"
    with pytest.raises(ConfigurationError, match=r"group 'lariat\.controllers'"):
        own("bad").load()


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("missing:Good", "no module 'missing'; install its package, or start Lariat in the folder"),
        ("outside:Best", "has no attribute 'Best'"),
        ("outside:SOMETHING", "is no class"),
        ("outside:Picky", r"its constructor raised ValueError: wants a GPU \(outside.py:11\)"),
        ("broken:Good", "no module 'nothing_of_this_name'"),
        ("raising:Good", r"its module raised ZeroDivisionError.*raising.py:1"),
    ],
)
def test_a_class_that_cannot_be_used_is_refused_by_name(name: str, message: str):
    with pytest.raises(ConfigurationError, match=message) as caught:
        own(name).create((), None)
    assert name in str(caught.value)


def test_a_class_without_a_required_method_is_refused():
    with pytest.raises(ConfigurationError, match=r"lacks velocity\(\)"):
        own("outside:Good").create(("reset", "velocity"), None)


def test_a_fault_names_key_class_exception_and_line():
    good = own("outside:Good").create((), None)
    with (
        pytest.raises(ExtensionFault, match=r"reset\(\).*KeyError: 'left'.*outside\.py:7"),
        own("outside:Good").guarded("reset"),
    ):
        good.reset()


@pytest.mark.parametrize(
    ("answer", "message"),
    [
        (None, "answered"),
        ("fast", "answered no array"),
        ([[1.0], [2.0, 3.0]], "answered no array"),
        (np.zeros(6), r"shape \(6,\), not \(2, 6\)"),
        (np.full((2, 6), np.inf), "not finite"),
        (np.full((2, 6), np.nan), "not finite"),
    ],
)
def test_an_answer_that_is_no_finite_array_of_its_shape_is_a_fault(answer: object, message: str):
    with pytest.raises(ExtensionFault, match=message):
        own("outside:Good").checked("velocity", answer, (2, 6))


def with_method(name: str) -> Scenario:
    scenario = load("three-cylinders")
    return replace(scenario, control=replace(scenario.control, method=name))


def test_a_recording_names_no_class_unless_it_is_allowed():
    scenario = with_method("outside:Good")
    assert [found.name for found in extensions_of(scenario)] == ["outside:Good"]
    require_allowed(scenario, ("outside:Good",))
    with pytest.raises(ConfigurationError, match="--allow outside:Good"):
        require_allowed(scenario, ("outside:Better",))


def test_names_of_our_own_are_no_extensions():
    assert extensions_of(load("three-cylinders")) == ()
    for name in CONTROL_METHODS.included:
        assert extensions_of(with_method(name)) == ()
