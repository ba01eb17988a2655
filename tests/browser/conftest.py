"""Pages of a cell in a browser, and pictures of them where `--screenshots` asks."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Page

from tests.browser.cell import Cell, opened_cell

SIZES = ((1280, 800), (1920, 1080))
"""Widths and heights of the window [pixels]."""
SETTLING_TIME = 500.0
"""Time that the page gets to draw itself in another size [ms]."""


@pytest.fixture(scope="module")
def bench() -> Iterator[tuple[Cell, Page]]:
    """Page in a window of 1280 x 800 pixels."""
    with opened_cell() as both:
        yield both


@pytest.fixture(scope="module")
def cell() -> Iterator[tuple[Cell, Page]]:
    """Page in a window of 1440 x 810 pixels."""
    with opened_cell(size=(1440, 810)) as (stage, page):
        page.get_by_role("button", name="Edit goal").wait_for()
        yield stage, page


@pytest.fixture(autouse=True)
def kept_screenshots(request: pytest.FixtureRequest) -> Iterator[None]:
    """Keep pictures of the page that a fixture of the test has opened."""
    yield
    folder: Path | None = request.config.getoption("--screenshots")
    values = getattr(request.node, "funcargs", {}).values()
    pages = {part for v in values if isinstance(v, tuple) for part in v if isinstance(part, Page)}
    if folder is None or not pages:
        return
    folder.mkdir(parents=True, exist_ok=True)
    (page,) = pages
    before = page.viewport_size
    name = re.sub(r"\W+", "-", request.node.name)
    for width, height in SIZES:
        page.set_viewport_size({"width": width, "height": height})
        page.wait_for_timeout(SETTLING_TIME)
        page.screenshot(path=folder / f"{name}-{width}.png")
    if before is not None:
        page.set_viewport_size(before)
