"""Banner of the page in a real browser: the server and the stack go and come back."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from playwright.sync_api import expect

from dashboard.options import DashboardOptions
from dashboard.service import build
from shared.messages import ArmCommand
from shared.runtime.free_port import free_port
from tests.browser.cell import SCENARIO, Cell
from tests.browser.chromium import NO_CHROMIUM, comes, opened
from tests.dashboard.stage import Stage

pytestmark = NO_CHROMIUM

SILENCE = """() => {
  window.isTheSame = true;
  const drop = (event) => event.stopImmediatePropagation();
  window.addEventListener("lariat-news", drop, true);
  window.dispatchEvent(new CustomEvent("lariat-lost"));
  setTimeout(() => window.removeEventListener("lariat-news", drop, true), 4000);
  return document.querySelector("#banner").textContent;
}"""
"""Script that lets the page hear nothing for 4 s, and returns what its banner says."""


def test_page_says_that_it_shows_the_past_and_comes_back_with_the_server(tmp_path: Path) -> None:
    options = DashboardOptions(port=free_port(), token_file=tmp_path / "token")
    service = build(SCENARIO, "dashboard-ab", options)
    service.warm_up()
    cell = Cell(Stage(service, SCENARIO))
    cell.start()
    with opened(service.address) as page:
        assert page.title() == "three-cylinders · Lariat"
        expect(page.get_by_text("Running:")).to_be_visible()
        # Silence on an open connection, as of a browser that is busy, loses no work on the page.
        assert "No connection to the dashboard" in page.evaluate(SILENCE)
        expect(page.locator("#banner")).to_be_hidden()
        assert page.evaluate("window.isTheSame")
        cell.end()
        service.close()
        expect(page.locator("#banner")).to_contain_text("No connection to the dashboard")
        greyed = "getComputedStyle(document.querySelector('#root')).filter"
        assert "grayscale(1)" in page.evaluate(greyed)
        page.keyboard.press("Space")
        # A thread of its own, because Playwright's event loop runs in this one.
        with ThreadPoolExecutor(1) as pool:
            service = pool.submit(build, SCENARIO, "dashboard-cd", options).result()
            holds: list[ArmCommand] = []
            service.reflex.connect(holds.append)
            # Before there is a page again, the press reaches the arms.
            expect(page.locator("#stop-bar")).to_contain_text("HOLD works")
            assert comes(page, lambda: bool(holds))
            pool.submit(service.warm_up).result()
        cell = Cell(Stage(service, SCENARIO))
        cell.start()
        try:
            expect(page.locator("#banner")).to_be_hidden()
            expect(page.get_by_text("Running:")).to_be_visible()
            # The stack has died, the dashboard has not.
            cell.dead = True
            expect(page.locator("#banner")).to_contain_text("silent for")
        finally:
            cell.end()
            service.close()
