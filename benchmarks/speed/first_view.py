"""First view of a page in headless Chromium, as the browser itself clocks it."""

from __future__ import annotations

import shutil
import tempfile
import time

from lariat.configuration import ConfigurationError

BROWSERS = ("chromium", "chromium-browser", "google-chrome")
"""Programs that are looked for."""
FLAGS = ("--use-angle=swiftshader", "--enable-unsafe-swiftshader")
"""Drawing without a graphics card."""
TIMEOUT = 60_000
"""Longest wait for the first view [ms]."""
PAINT_SCRIPT = """() => new Promise(done => new PerformanceObserver(list => {
  const [entry] = list.getEntriesByName("first-contentful-paint");
  if (entry) done(performance.timeOrigin + entry.startTime);
}).observe({type: "paint", buffered: true}))"""
"""Time at which the first text or image is drawn, by the W3C's Paint Timing, since 1970 [ms]."""
OTHER_PAGE = "data:text/html,<p>Lariat</p>"
"""Page that a browser shows before."""


def find_browser() -> str:
    """Return the path of an installed browser.

    Raises:
        ConfigurationError: There is none, or Playwright, which drives it, is not installed.
    """
    try:
        import playwright.sync_api  # noqa: F401
    except ImportError:
        raise ConfigurationError("--browser needs Playwright: pip install -e '.[bench]'") from None
    for name in BROWSERS:
        if (path := shutil.which(name)) is not None:
            return path
    raise ConfigurationError(
        f"--browser needs one of {', '.join(BROWSERS)} on the PATH; none is there"
    )


def first_view(browser: str, address: str) -> tuple[float, float]:
    """Open the page of a dashboard in a browser that is open and has nothing of it in its cache.

    Return the times since then at which the browser has drawn the first text or image, and at which
    the page's controls are there [s].
    """
    from playwright.sync_api import sync_playwright

    with (
        sync_playwright() as playwright,
        tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder,
    ):
        context = playwright.chromium.launch_persistent_context(
            folder, executable_path=browser, headless=True, args=["--no-sandbox", *FLAGS]
        )
        context.set_default_timeout(TIMEOUT)
        page = context.pages[0]
        # A browser that has drawn nothing yet needs half a second for a page of one word.
        page.goto(OTHER_PAGE)
        page.evaluate(PAINT_SCRIPT)
        begun = time.time()
        page.goto(address)
        # The web server goes on to the page itself.
        page.wait_for_url(lambda url: "token=" not in url, wait_until="commit")
        page.locator("#root button").first.wait_for()
        usable = time.time()
        painted = page.evaluate(PAINT_SCRIPT)
        context.close()
    return painted / 1e3 - begun, usable - begun
