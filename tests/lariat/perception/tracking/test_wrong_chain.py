from __future__ import annotations

import pytest

from lariat.perception.tracking.wrong_chain import WrongChainModel

FRAME = 33_000_000


def stated(*inconsistencies: float) -> list[float]:
    model = WrongChainModel()
    return [model.take(c, (k + 1) * FRAME) for k, c in enumerate(inconsistencies)]


def test_a_chain_that_agrees_with_its_images_is_hardly_ever_wrong() -> None:
    assert max(stated(*20 * [0.0])) < 2e-3


def test_p_wrong_grows_with_the_inconsistency() -> None:
    stated_values = [stated(c)[0] for c in (0.0, 0.1, 0.3, 1.0)]
    assert sorted(set(stated_values)) == stated_values
    assert stated(7.0) == stated(1.0)


def test_an_earlier_inconsistency_is_remembered_for_seconds() -> None:
    never = stated(*200 * [0.05])
    once = stated(0.8, *199 * [0.05])
    assert once[1] > 3.0 * never[1]
    assert once[10] > 1.5 * never[10]
    assert once[190] == pytest.approx(never[190], rel=0.05)


def test_a_reset_forgets_it() -> None:
    model = WrongChainModel()
    model.take(0.8, FRAME)
    model.forget()
    assert model.take(0.05, 2 * FRAME) == stated(0.05)[0]


def test_a_chain_that_begins_in_contradiction_is_doubted_at_once() -> None:
    at_once, lasting = stated(0.8, 0.8)
    assert at_once == pytest.approx(lasting, rel=0.05)
