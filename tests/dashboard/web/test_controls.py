"""Who has the controls: one page, which others ask."""

from __future__ import annotations

import pytest

from dashboard.web.controls import ANSWER_TIME, RELOAD_TIME, Controls


@pytest.fixture
def controls() -> Controls:
    """Controls of which `a` has come first and `b` second."""
    controls = Controls()
    for page in ("a", "a", "b"):
        controls.enter(page, 0.0)
    return controls


def test_first_page_has_the_controls_and_the_second_watches(controls: Controls) -> None:
    assert (controls.role("a"), controls.role("b")) == ("holder", "watcher")
    assert controls.holds("a")
    assert not controls.holds("b")
    assert not controls.holds("")


@pytest.mark.parametrize(("give", "holder"), [(True, "b"), (False, "a")])
def test_page_that_asks_gets_the_controls_when_the_holder_gives_them(
    controls: Controls, give: bool, holder: str
) -> None:
    controls.ask("b", 1.0)
    assert controls.is_asked_for
    assert controls.asks("b")
    controls.answer("b", True)
    assert controls.holds("a"), "only the holder answers"
    controls.answer("a", give)
    assert controls.holds(holder)
    assert not controls.is_asked_for


def test_holder_that_does_not_answer_loses_the_controls(controls: Controls) -> None:
    controls.ask("b", 1.0)
    controls.advance(1.0 + 0.9 * ANSWER_TIME)
    assert controls.holds("a")
    controls.advance(1.0 + 1.1 * ANSWER_TIME)
    assert controls.holds("b")


def test_holder_keeps_the_controls_through_a_reload(controls: Controls) -> None:
    controls.leave("a", 1.0)
    controls.leave("a", 1.0)
    controls.advance(1.0 + 0.9 * RELOAD_TIME)
    controls.enter("a", 1.0 + 0.9 * RELOAD_TIME)
    controls.advance(99.0)
    assert controls.holds("a")


def test_controls_of_a_page_that_is_gone_are_free_until_somebody_takes_them(
    controls: Controls,
) -> None:
    controls.leave("a", 1.0)
    controls.advance(99.0)
    assert controls.holds("a"), "one connection is left"
    controls.leave("a", 99.0)
    controls.advance(99.0 + 1.1 * RELOAD_TIME)
    assert controls.role("b") == "free"
    controls.ask("b", 120.0)
    assert controls.holds("b")


def test_page_that_asked_and_left_gets_nothing(controls: Controls) -> None:
    controls.ask("b", 1.0)
    controls.leave("b", 2.0)
    controls.advance(99.0)
    assert controls.holds("a")
    assert not controls.is_asked_for
