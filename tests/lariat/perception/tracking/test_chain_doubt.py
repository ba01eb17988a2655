from __future__ import annotations

import pytest

from lariat.perception.tracking.chain_doubt import ChainDoubt

FRAME = 33_000_000


def stated(*contradictions: float) -> list[float]:
    doubt = ChainDoubt()
    return [doubt.take(c, (k + 1) * FRAME) for k, c in enumerate(contradictions)]


def test_a_chain_that_agrees_with_its_images_is_hardly_ever_wrong() -> None:
    assert max(stated(*20 * [0.0])) < 2e-3


def test_doubt_grows_with_the_contradiction() -> None:
    doubts = [stated(c)[0] for c in (0.0, 0.1, 0.3, 1.0)]
    assert sorted(set(doubts)) == doubts
    assert stated(7.0) == stated(1.0)


def test_an_earlier_contradiction_is_remembered_for_seconds() -> None:
    never = stated(*200 * [0.05])
    once = stated(0.8, *199 * [0.05])
    assert once[1] > 3.0 * never[1]
    assert once[10] > 1.5 * never[10]
    assert once[190] == pytest.approx(never[190], rel=0.05)


def test_a_reset_forgets_it() -> None:
    doubt = ChainDoubt()
    doubt.take(0.8, FRAME)
    doubt.forget()
    assert doubt.take(0.05, 2 * FRAME) == stated(0.05)[0]
