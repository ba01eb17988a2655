"""Values that a campaign varies: typed texts and the settings that they make."""

from __future__ import annotations

import pytest

from dashboard.panels.campaign.value_list import plain_value, values_of
from dashboard.panels.scenario.setting_fields import SettingField, sections
from lariat.configuration import ConfigurationError
from lariat.scenario import load

FIELDS: dict[str, SettingField] = {
    field.key: field for section in sections(load("three-cylinders")).values() for field in section
}


@pytest.mark.parametrize(
    ("key", "text", "values"),
    [
        ("control.clearance", "0.01, 0.02,", ["0.01", "0.02"]),
        ("control.method", "gauss_newton,actions", ['"gauss_newton"', '"actions"']),
        ("control.adapt", "true, false", ["true", "false"]),
        (
            "sensing.resolution",
            "[640, 480], [320,240]",
            ["[640, 480]", "[320, 240]"],
        ),
    ],
)
def test_text_is_split_at_its_commas(key: str, text: str, values: list[str]) -> None:
    assert values_of(FIELDS[key], text) == values


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "type its values"),
        ("0.01, 0.01", "stands there twice"),
        ("0.01, 5", "out of bounds"),
        ("a", "control.clearance"),
        ("[0.1", "control.clearance"),
    ],
)
def test_what_is_wrong_with_a_text_is_said(text: str, words: str) -> None:
    with pytest.raises(ConfigurationError, match=words):
        values_of(FIELDS["control.clearance"], text)


def test_value_is_shown_without_quotes() -> None:
    assert [plain_value(v) for v in ('"actions"', "0.02", "[1, 2]")] == [
        "actions",
        "0.02",
        "[1, 2]",
    ]


def test_value_of_deep_brackets_or_a_broken_text_is_shown_as_it_is() -> None:
    for value in ("[" * 4000, '"open'):
        assert plain_value(value) == value
