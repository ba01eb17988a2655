"""First steps and sizes of the window in a real browser."""

from __future__ import annotations

from playwright.sync_api import expect

from dashboard.options import DashboardOptions
from dashboard.service import build
from shared import topics
from shared.messages import ArmCommand, ArmStates
from tests.browser.cell import SCENARIO, Cell
from tests.browser.chromium import NO_CHROMIUM, opened
from tests.browser.stack import free_port
from tests.dashboard.stage import Stage

pytestmark = NO_CHROMIUM


def test_first_steps_follow_the_cell_and_stay_closed_after_a_reload() -> None:
    service = build(SCENARIO, "dashboard-ab", DashboardOptions(port=free_port()))
    cell = Cell(Stage(service, SCENARIO))
    cell.start()
    try:
        with opened(service.address, 1280, 800) as page:
            guide = page.locator("#guide")
            expect(guide).to_contain_text("Press Edit goal")
            expect(guide.locator("li.done")).to_have_count(3)
            cell.show_arms(mode=ArmStates.HOLDING, needs_acknowledgement=True)
            expect(guide.locator("li.done")).to_have_count(4)
            page.get_by_role("button", name="Close the first steps").click()
            expect(guide).to_be_hidden()
            page.reload()
            again = page.get_by_role("button", name="Show the first steps")
            expect(again).to_be_visible()
            expect(guide).to_be_hidden()
            again.click()
            expect(guide).to_contain_text("First steps")
            disarm = page.get_by_role("button", name="Disarm")
            for width, height in ((1280, 800), (390, 844)):
                page.set_viewport_size({"width": width, "height": height})
                expect(page.locator("#stop-bar .hold")).to_be_visible()
                hold = page.locator("#stop-bar .hold").bounding_box()
                assert hold is not None
                assert hold["x"] >= 0.0
                assert hold["x"] + hold["width"] <= width
                assert hold["y"] + hold["height"] <= height
                # A phone only watches.
                expect(disarm).to_have_css("pointer-events", "none" if width < 700 else "auto")
            expect(page.locator("#banner")).to_contain_text("only watches; HOLD works")
            expect(guide).to_be_hidden()
            page.locator("#stop-bar .hold").click()
            assert cell.asked(topics.ARM_COMMAND).action == ArmCommand.HOLD
            # Whoever asks a phone for the controls has them without its answer.
            desk = page.context.new_page()
            desk.set_viewport_size({"width": 1280, "height": 800})
            desk.goto(service.address)
            desk.get_by_role("button", name="Ask for the controls").click()
            expect(desk.locator("#banner")).to_be_hidden(timeout=10_000)
    finally:
        cell.end()
        service.close()
