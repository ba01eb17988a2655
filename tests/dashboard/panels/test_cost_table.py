"""Cost of the horizon by term."""

from __future__ import annotations

import math

from dashboard.panels.cost_table import cost_html


def test_terms_are_sorted_and_their_bars_are_their_shares() -> None:
    page = cost_html({"effort": 1.0, "tracking": 3.0})
    assert page.index("tracking") < page.index("effort")
    assert "width:75%" in page
    assert "width:25%" in page


def test_hostile_terms_are_shown_as_text_or_not_at_all() -> None:
    assert "<b>" not in cost_html({"<b>": 1.0})
    assert cost_html({"tracking": math.nan, "effort": math.inf}) == ""
    assert "width:0%" in cost_html({"tracking": -1.0})
