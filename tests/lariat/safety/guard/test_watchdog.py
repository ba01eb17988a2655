from __future__ import annotations

import pytest

from lariat.safety.guard.watchdog import Watchdog

NOW = 1_000_000_000
MILLISECOND = 1_000_000


def fed() -> Watchdog:
    watchdog = Watchdog()
    watchdog.feed(NOW)
    watchdog.tick(NOW)
    return watchdog


@pytest.mark.parametrize(
    ("age", "brakes", "holds"),
    [
        (0, False, False),
        (49, False, False),
        (51, True, False),
        (99, True, False),
        (101, True, True),
    ],
)
def test_old_setpoints_brake_first_and_hold_later(age: int, brakes: bool, holds: bool) -> None:
    now = NOW + age * MILLISECOND
    assert fed().must_brake(now, 0.0) is brakes
    assert fed().must_hold(now, 0.0) is holds


def test_age_counts_up_to_the_end_of_the_next_step() -> None:
    now = NOW + 45 * MILLISECOND
    assert not fed().must_brake(now, 0.004)
    assert fed().must_brake(now, 0.008)


def test_fresh_setpoints_start_the_age_anew() -> None:
    watchdog = fed()
    watchdog.feed(NOW + 90 * MILLISECOND)
    assert not watchdog.must_brake(NOW + 130 * MILLISECOND, 0.008)


@pytest.mark.parametrize(("gap", "stalled"), [(8, False), (99, False), (101, True)])
def test_gateway_that_stood_still_has_stalled(gap: int, stalled: bool) -> None:
    assert fed().stalled(NOW + gap * MILLISECOND) is stalled


def test_first_tick_comes_one_period_after_nothing() -> None:
    assert Watchdog().elapsed(NOW) == 0.008
    assert not Watchdog().stalled(NOW)
