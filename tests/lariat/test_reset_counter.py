from __future__ import annotations

from lariat.reset_counter import ResetCounter


def resets(*counts: int) -> list[bool]:
    counter = ResetCounter()
    return [counter.advanced(count) for count in counts]


def test_each_added_reset_acts_once() -> None:
    assert resets(1, 2, 2, 3) == [False, True, False, True]


def test_count_that_is_heard_first_resets_nothing() -> None:
    assert resets(7, 8) == [False, True]


def test_restart_of_the_sender_resets_nothing() -> None:
    assert resets(3, 0, 3, 4) == [False, False, False, True]


def test_count_that_began_again_resets_nothing_and_goes_on() -> None:
    assert resets(5, 1, 2) == [False, False, True]
