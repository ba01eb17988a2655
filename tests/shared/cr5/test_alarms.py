from __future__ import annotations

import pytest

from services.robot_gateway.drivers.cr5.replies import Reply
from shared.cr5.alarms import ALARM_TEXTS, MODE_TEXTS, alarm_text


@pytest.mark.parametrize(
    "numbers",
    [
        (16, 17, 18, 19, 22, 23, 24, 26, 27, 28, 29),
        range(32, 38),
        range(48, 54),
        range(64, 76),
        (116, 117, 119, 132, 133, 165, 194, 224),
        range(242, 248),
        range(2069, 2075),
        (2050, *range(50224, 50231), -2, -3),
    ],
)
def test_every_alarm_worth_knowing_has_words(numbers: tuple[int, ...]) -> None:
    for number in numbers:
        assert number in ALARM_TEXTS
        assert alarm_text(number) == f"alarm {number}: {ALARM_TEXTS[number]}"


def test_joint_of_an_alarm_is_the_one_that_it_says() -> None:
    assert "joint 1" in ALARM_TEXTS[48]
    assert "joint 6" in ALARM_TEXTS[53]
    assert "joint 1" in ALARM_TEXTS[64]
    assert "positive" in ALARM_TEXTS[64]
    assert "joint 6" in ALARM_TEXTS[75]
    assert "negative" in ALARM_TEXTS[75]
    assert "joint 6" in ALARM_TEXTS[247]


def test_modes_8_and_11_differ_between_the_versions() -> None:
    differing = {n for n in MODE_TEXTS["v3"] if MODE_TEXTS["v3"][n] != MODE_TEXTS["v4"][n]}
    assert differing == {8, 11}


@pytest.mark.parametrize(
    ("code", "words"),
    [
        (-1, "failed"),
        (-2, "the arm is in alarm"),
        (-7, "a script is paused"),
        (-9, "this command is switched off on the arm"),
        (-10000, "no such command on this firmware"),
        (-20000, "wrong number of arguments"),
        (-30002, "type of argument 2 is wrong"),
        (-40012, "range of argument 12 is wrong"),
        (-50001, "type of option 1 is wrong"),
        (-60003, "range of option 3 is wrong"),
    ],
)
def test_error_codes_have_words(code: int, words: str) -> None:
    assert Reply(code, "", "X()").words == words
