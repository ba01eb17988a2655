from __future__ import annotations

import numpy as np

from shared.runtime.pace import Pace

MILLISECOND = 1_000_000
PERIOD = 20 * MILLISECOND
DURATION = 6 * MILLISECOND
"""Duration of a step [ns]."""


def begun(messages: list[int], end: int, period: int = PERIOD) -> tuple[list[int], list[int]]:
    """When the steps of a service begin that messages wake; all, and those of messages [ns]."""
    pace, instants, woken = Pace(period, 0), [0], [False]
    waiting = sorted(messages)
    while instants[-1] < end:
        now = instants[-1] + DURATION
        deadline = pace.deadline(instants[-1], now, woken=woken[-1])
        woken.append(bool(waiting) and waiting[0] < max(deadline, now))
        if woken[-1]:
            deadline = pace.earliest(max(now, waiting[0]))
        instants.append(max(now, deadline))
        waiting = [message for message in waiting if message > instants[-1]]
    return instants, [at for at, by_message in zip(instants, woken, strict=True) if by_message]


def test_without_messages_the_steps_keep_an_absolute_schedule() -> None:
    instants, _ = begun([], 50 * PERIOD)
    np.testing.assert_array_equal(np.diff(instants), PERIOD)


def test_steps_that_were_missed_are_skipped() -> None:
    pace = Pace(PERIOD, 0)
    assert pace.deadline(0, 3 * PERIOD + 1, woken=False) == 4 * PERIOD


def test_images_begin_steps_at_once_and_do_not_raise_the_rate() -> None:
    """Every image of a camera begins a step when it comes, though its rate divides no other."""
    images = [round((k + 0.3) * 100 * MILLISECOND / 3) for k in range(300)]
    instants, woken = begun(images, images[-1])
    assert woken == images
    assert len(instants) <= images[-1] // PERIOD + 2
    assert max(np.diff(instants)) <= 2 * PERIOD


def test_images_that_jitter_begin_steps_at_once() -> None:
    jitter = np.random.default_rng(0).uniform(-3.0, 3.0, 300)
    images = [round((k * 100 / 3 + 40 + jitter[k]) * MILLISECOND) for k in range(300)]
    instants, woken = begun(images, images[-1])
    # The first one may come while the first steps are under way.
    assert woken[1:] == images[1:]
    assert len(instants) <= images[-1] // PERIOD + 2


def test_frequent_messages_do_not_postpone_the_schedule() -> None:
    messages = [k * PERIOD // 2 for k in range(1, 100)]
    instants, woken = begun(messages, 100 * PERIOD)
    assert woken[-1] == messages[-1]
    after = [at - messages[-1] for at in instants if at > messages[-1]]
    assert after[0] <= 2 * PERIOD
    assert after[1] <= 3 * PERIOD


def test_a_flood_of_messages_begins_no_more_than_four_steps_in_a_period() -> None:
    period = 100 * MILLISECOND
    instants, _ = begun(list(range(0, 10 * period, MILLISECOND)), 9 * period, period)
    assert min(np.diff(instants[1:])) >= period // 4
