"""Tab of the scenario in a real browser: settings by mouse and keyboard, and what is requested."""

from __future__ import annotations

from playwright.sync_api import expect

from dashboard.options import DashboardOptions
from dashboard.service import build
from shared import topics
from shared.messages import ScenarioEntry, StackRequest, StackState, TaskRequest
from tests.browser.cell import SCENARIO, Cell
from tests.browser.chromium import NO_CHROMIUM, field, opened
from tests.browser.stack import free_port
from tests.dashboard.stage import Stage

pytestmark = NO_CHROMIUM


def test_settings_are_checked_started_and_saved() -> None:
    service = build(SCENARIO, "dashboard-ab", DashboardOptions(port=free_port()))
    cell = Cell(Stage(service, SCENARIO))
    entries = [
        ScenarioEntry(name="fixed-end", description="One end is fixed."),
        ScenarioEntry(name="lab", description="Ours.", own=True, real_arms=["10.0.0.6"]),
    ]
    cell.stack = StackState(scenario="three-cylinders", scenarios=entries)
    cell.start()
    try:
        with opened(service.address, 1280, 800) as page:
            page.get_by_role("tab", name="Scenario").click()
            expect(page.get_by_text("Runs: three-cylinders")).to_be_visible()
            # Switched without a restart.
            page.get_by_role("tab", name="Rope").click()
            field(page, "Adapt").check()
            request = cell.asked(topics.TASK_REQUEST)
            assert (request.action, request.key, request.value) == (
                TaskRequest.SET,
                "adapt",
                "true",
            )
            page.get_by_role("tab", name="Scenario").click()
            # A value out of bounds is named at once, and asks for nothing.
            field(page, "clearance [m]").fill("5")
            expect(page.get_by_text("control.clearance = 5.0 m is out of bounds")).to_be_visible()
            start = page.get_by_role("button", name="Start …")
            start.click()
            expect(page.get_by_role("dialog")).to_have_count(0)
            field(page, "clearance [m]").fill("0.02")
            expect(page.get_by_text("control.clearance: 0.012 → 0.02")).to_be_visible()
            start.click()
            page.get_by_role("dialog").get_by_role("button", name="Start", exact=True).click()
            request = cell.asked(topics.STACK_REQUEST)
            assert request.action == StackRequest.START
            assert (request.scenario, list(request.settings)) == ("", ["control.clearance=0.02"])
            field(page, "Name").fill("mine")
            page.get_by_role("button", name="Save", exact=True).click()
            request = cell.asked(topics.STACK_REQUEST)
            assert (request.action, request.name) == (StackRequest.SAVE, "mine")
            assert list(request.settings) == ["control.clearance=0.02"]
            # A scenario with real arms is started by a button that says so.
            page.get_by_role("combobox", name="Scenario").click()
            page.get_by_role("option", name="lab").click()
            expect(page.get_by_text("Ours.")).to_be_visible()
            start.click()
            dialog = page.get_by_role("dialog")
            expect(dialog).to_contain_text("It drives the real arms at 10.0.0.6")
            dialog.get_by_role("button", name="Start real arms").click()
            request = cell.asked(topics.STACK_REQUEST)
            assert (request.scenario, list(request.confirmed)) == ("lab", ["10.0.0.6"])
            # Without a launcher, the page says what is missing.
            cell.stack = None
            expect(page.get_by_text("Nobody who starts scenarios answers")).to_be_visible()
            expect(start).to_be_disabled()
    finally:
        cell.end()
        service.close()
