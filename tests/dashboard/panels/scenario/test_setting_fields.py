"""Fields of settings: from the configuration's types, with bounds, defaults and present values."""

from __future__ import annotations

import pytest

from dashboard.panels.scenario.setting_fields import SettingField, sections
from lariat.configuration import ConfigurationError
from lariat.scenario import find, load
from lariat.scenario.reference import field_notes
from lariat.scenario.sections import Control
from lariat.scenario.settings import load_with
from lariat.scenario.shipped import shipped_names


def fields(name: str) -> dict[str, SettingField]:
    found = sections(load(name))
    return {field.key: field for section in found.values() for field in section}


def test_field_says_meaning_bounds_unit_and_default() -> None:
    clearance = fields("three-cylinders")["control.clearance"]
    assert (clearance.unit, clearance.name) == ("m", "clearance")
    meaning = field_notes(Control)["clearance"]
    assert "distance" in meaning
    assert clearance.hint == f"{meaning} 0 … 0.2 m. Default: 0.012."


def test_value_is_the_file_s_and_else_the_default() -> None:
    scenario = load_with(find("fixed-end"), ["ends.left.grip_length=0.02"])
    found = {f.key: f.value for section in sections(scenario).values() for f in section}
    assert found["ends.left.driver"] == "fixed"
    assert found["control.iterations"] == str(Control().iterations)
    # Between its grips, the rope is shorter than the file says.
    assert float(found["rope.length"]) == pytest.approx(scenario.rope.length + 0.02)


def test_choices_are_offered() -> None:
    found = fields("rope")
    assert found["control.method"].options[:3] == ("gauss_newton", "network", "actions")
    assert found["control.adapt"].options == ("true", "false")
    assert found["sensing.source"].options == ("truth", "camera")


@pytest.mark.parametrize("name", shipped_names())
def test_every_present_value_makes_a_setting_that_changes_nothing(name: str) -> None:
    scenario = load(name)
    settings = [field.setting(field.value) for field in fields(name).values() if field.value]
    assert load_with(find(name), settings) == scenario


@pytest.mark.parametrize(
    ("key", "text", "words"),
    [
        ("control.clearance", "5", "out of bounds"),
        ("control.clearance", "", "must be a float"),
        ("control.clearance", "nan", "finite"),
        ("control.horizon", "2.5", "must be a int"),
        ("limits.workspace", "[[0, 0, 0]]", "takes 2 values"),
        ("control.method", "fast", "is not one of"),
    ],
)
def test_wrong_value_is_named(key: str, text: str, words: str) -> None:
    with pytest.raises(ConfigurationError, match=words):
        fields("rope")[key].setting(text)


def test_text_is_quoted_and_cannot_bring_another_key() -> None:
    setting = fields("rope")["description"].setting('a"\n[control]\nclearance = 0.1')
    scenario = load_with(find("rope"), [setting])
    assert scenario.description == 'a"\n[control]\nclearance = 0.1'
    assert scenario.control == load("rope").control
