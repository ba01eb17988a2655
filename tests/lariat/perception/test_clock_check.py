from __future__ import annotations

import pytest

from lariat.perception.clock_check import FRESH_AGE, MAX_LAG, MAX_LEAD, ClockCheck
from lariat.trajectory import SECOND

GATEWAY, HERE = 7_000 * SECOND, 3 * SECOND
"""Present times of the gateway, and of this process: its own clock does not matter."""


@pytest.fixture
def check() -> ClockCheck:
    check = ClockCheck()
    check.take(GATEWAY, HERE)
    return check


@pytest.mark.parametrize("lead", [0, MAX_LEAD, -SECOND // 10, -MAX_LAG])
def test_latency_is_no_difference_of_clocks(check: ClockCheck, lead: int) -> None:
    assert check.fault(GATEWAY + lead, HERE) == ""


@pytest.mark.parametrize(
    ("lead", "words"),
    [(3600 * SECOND, "3600.00 s ahead of"), (-3600 * SECOND, "3600.00 s behind")],
)
def test_clocks_an_hour_apart_are_named(check: ClockCheck, lead: int, words: str) -> None:
    assert words in check.fault(GATEWAY + lead, HERE)


def test_gateway_that_is_silent_says_nothing_of_its_clock(check: ClockCheck) -> None:
    later = HERE + FRESH_AGE // 2
    assert check.fault(GATEWAY + FRESH_AGE // 2 + MAX_LEAD, later) == ""
    assert check.fault(GATEWAY + 3600 * SECOND, later) != ""
    assert check.fault(GATEWAY + 3600 * SECOND, HERE + FRESH_AGE + 1) == ""
    assert ClockCheck().fault(GATEWAY, HERE) == ""
