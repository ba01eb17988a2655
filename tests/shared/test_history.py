from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from shared.history import History


@given(st.integers(2, 4000), st.integers(8, 64))
def test_history_spans_all_time_within_its_capacity(count: int, capacity: int) -> None:
    history = History(1, capacity)
    for k in range(count):
        history.add(0.02 * k, float(k))
    time, value = history.columns
    assert len(history) == len(time) <= capacity
    assert time[0] == 0.0
    assert np.all(np.diff(time) > 0.0)
    np.testing.assert_allclose(value, time / 0.02)
    # The newest row may be missing by no more than the present spacing.
    assert 0.02 * (count - 1) - time[-1] <= 2.0 * max(np.diff(time), default=0.0)


def test_a_time_that_does_not_advance_is_not_taken_twice() -> None:
    history = History(1)
    assert history.add(1.0, 5.0)
    assert not history.add(1.0, 6.0)
    assert not history.add(0.5, 7.0)
    history.clear()
    assert history.add(0.5, 7.0)
