"""Ages of the topics at their readers."""

from __future__ import annotations

from dashboard import palette
from dashboard.panels.topic_ages import ages_html, oldest_ages
from shared.messages import Health

HEALTH = {
    "controller": (Health(input_age_ms={"rope/nodes": 40.0, "arm/state": 8.0}), 0.1),
    "planner": (Health(input_age_ms={"rope/nodes": 4000.0}), 0.1),
}


def test_largest_age_of_a_topic_and_its_reader_are_shown() -> None:
    assert oldest_ages(HEALTH) == {
        "arm/state": (0.008, "controller"),
        "rope/nodes": (4.0, "planner"),
    }
    page = ages_html(HEALTH)
    assert "4.0 s" in page
    assert "8 ms" in page
    assert page.count(palette.css(palette.WARNING)) == 1


def test_nothing_is_shown_before_the_first_health() -> None:
    assert ages_html({}) == ""
