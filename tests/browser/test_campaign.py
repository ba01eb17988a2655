"""Tab of campaigns in a real browser: fields by mouse and keyboard, and what is requested."""

from __future__ import annotations

from pathlib import Path

from playwright.sync_api import expect

from dashboard.options import DashboardOptions
from dashboard.service import build
from shared import topics
from shared.messages import CampaignState, CampaignTrial, ScenarioEntry, StackRequest, StackState
from tests.browser.cell import SCENARIO, Cell
from tests.browser.chromium import NO_CHROMIUM, field, opened
from tests.browser.stack import free_port
from tests.dashboard.stage import Stage

pytestmark = NO_CHROMIUM


def test_campaign_is_run_watched_canceled_and_downloaded() -> None:
    service = build(SCENARIO, "dashboard-ab", DashboardOptions(port=free_port()))
    cell = Cell(Stage(service, SCENARIO))
    cell.stack = StackState(scenario="three-cylinders", scenarios=[ScenarioEntry(name="rope")])
    cell.start()
    try:
        with opened(service.address, 1280, 800) as page:
            page.get_by_role("tab", name="Campaign").click()
            expect(page.get_by_text("10 seeds = 10 trials.")).to_be_visible()
            field(page, "Seeds").fill("2")
            page.get_by_role("combobox", name="Vary", exact=True).fill("control.clear")
            page.get_by_role("option", name="control.clearance").click()
            # Without values, there is nothing to run.
            run = page.get_by_role("button", name="Run campaign")
            expect(page.get_by_text("type its values")).to_be_visible()
            expect(run).to_be_disabled()
            field(page, "Values").fill("0.012, 0.02")
            field(page, "Values").press("Enter")
            expect(page.get_by_text("2 seeds × 2 of control.clearance = 4 trials.")).to_be_visible()
            run.click()
            request = cell.asked(topics.STACK_REQUEST)
            assert request.action == StackRequest.RUN_CAMPAIGN
            assert (request.scenario, request.first_seed, request.seed_count) == ("", 0, 2)
            assert [(v.key, list(v.values)) for v in request.variations] == [
                ("control.clearance", ["0.012", "0.02"])
            ]
            assert request.stop_when_reached
            done = CampaignTrial(
                values=["0.012"], state=CampaignTrial.DONE, reached=True, error=4e-4, wall=9.0
            )
            cell.campaign = CampaignState(
                stamp=1,
                name="table",
                scenario="three-cylinders",
                keys=["control.clearance"],
                trials=[done, CampaignTrial(seed=1, values=["0.012"])],
                running=True,
            )
            expect(page.get_by_text("1 of 2 trials · 1 reached")).to_be_visible()
            expect(page.get_by_text("0.40 mm")).to_have_count(3)
            expect(run).to_be_disabled()
            page.get_by_role("button", name="Cancel campaign").click()
            assert cell.asked(topics.STACK_REQUEST).action == StackRequest.CANCEL_CAMPAIGN
            with page.expect_download() as download:
                page.get_by_role("button", name="Download table (CSV)").click()
            assert download.value.suggested_filename == "table.csv"
            lines = Path(download.value.path()).read_text().splitlines()
            assert lines[0].startswith("scenario,seed,control.clearance,state,reached")
            assert lines[1].startswith("three-cylinders,0,0.012,done,true,")
            # Without a launcher, nobody runs campaigns.
            cell.stack = None
            expect(run).to_be_disabled()
            expect(page.get_by_text("Nobody who starts scenarios")).to_have_count(0)
    finally:
        cell.end()
        service.close()
