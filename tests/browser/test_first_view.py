"""Times of the first view of a page, by a browser."""

from __future__ import annotations

import time

from benchmarks.speed.first_view import find_browser, first_view
from tests.browser.cell import started_cell
from tests.browser.chromium import NO_CHROMIUM

pytestmark = NO_CHROMIUM


def test_a_page_is_painted_before_it_can_be_used() -> None:
    with started_cell() as cell:
        begun = time.monotonic()
        painted, usable = first_view(find_browser(), cell.address)
        assert 0.0 < painted < usable < time.monotonic() - begun
