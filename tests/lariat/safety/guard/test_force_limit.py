from __future__ import annotations

import pytest

from lariat.safety.guard.force_limit import FORCE_MARGIN, ForceLimit


@pytest.mark.parametrize(("force", "end"), [(0.0, None), (20.0, None), (20.1, 1)])
def test_force_is_permitted_up_to_the_limit(force: float, end: int | None) -> None:
    assert ForceLimit(20.0).exceeded([0.0, force]) == end


def test_first_end_that_exceeds_is_named() -> None:
    assert ForceLimit(20.0).exceeded([30.0, 40.0]) == 0


def test_acknowledged_force_may_fluctuate_but_not_grow() -> None:
    limit = ForceLimit(20.0)
    limit.acknowledge([0.0, 30.0])
    assert limit.exceeded([0.0, 30.0 + FORCE_MARGIN]) is None
    assert limit.exceeded([0.0, 30.1 + FORCE_MARGIN]) == 1


def test_acknowledged_force_that_falls_may_not_rise_again() -> None:
    limit = ForceLimit(20.0)
    limit.acknowledge([30.0])
    assert limit.exceeded([25.0]) is None
    assert limit.exceeded([25.0 + FORCE_MARGIN + 0.1]) == 0


def test_limit_holds_again_once_the_force_is_under_it() -> None:
    limit = ForceLimit(20.0)
    limit.acknowledge([30.0])
    assert limit.exceeded([19.0]) is None
    assert limit.exceeded([20.5]) == 0


def test_acknowledging_a_force_under_the_limit_permits_no_more() -> None:
    limit = ForceLimit(20.0)
    limit.acknowledge([19.5])
    assert limit.exceeded([20.5]) == 0


def test_force_that_is_not_a_number_exceeds_the_limit() -> None:
    assert ForceLimit(10.0).exceeded([0.0, float("nan")]) == 1
