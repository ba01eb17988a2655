"""Named goals in a real browser: saved, set again, downloaded, deleted."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from playwright.sync_api import expect

from dashboard.options import DashboardOptions
from dashboard.service import build
from shared import topics
from shared.messages import GoalListRequest, TaskRequest, chain
from tests.browser.cell import SCENARIO, Cell
from tests.browser.chromium import NO_CHROMIUM, field, opened
from tests.browser.stack import free_port
from tests.dashboard.stage import Stage

pytestmark = NO_CHROMIUM


def test_goal_is_saved_set_again_downloaded_and_deleted() -> None:
    service = build(SCENARIO, "dashboard-ab", DashboardOptions(port=free_port()))
    stage = Stage(service, SCENARIO)
    cell = Cell(stage)
    cell.start()
    try:
        with opened(service.address, 1280, 800) as page:
            page.get_by_text("Saved goals").click()
            name = field(page, "Goal name")
            name.fill("arch")
            name.press("Tab")
            page.get_by_role("button", name="Save goal").click()
            request = cell.asked(topics.GOAL_LIST_REQUEST)
            assert (request.action, request.name) == (GoalListRequest.SAVE, "arch")
            assert request.goal == stage.goal()
            expect(page.get_by_role("button", name="Set saved goal")).to_be_disabled()
            page.get_by_role("combobox", name="Saved goal").click()
            page.get_by_role("option", name="arch").click()
            page.get_by_role("button", name="Set saved goal").click()
            request = cell.asked(topics.TASK_REQUEST)
            assert (request.action, request.goal) == (TaskRequest.SET_GOAL, stage.goal())
            with page.expect_download() as download:
                page.get_by_role("button", name="Download shape (CSV)").click()
            assert download.value.suggested_filename == "arch.csv"
            table = np.loadtxt(Path(download.value.path()), delimiter=",")
            assert table == pytest.approx(chain(stage.goal().positions), abs=1e-6)
            page.get_by_role("button", name="Delete goal …").click()
            page.get_by_role("dialog").get_by_role("button", name="Delete").click()
            request = cell.asked(topics.GOAL_LIST_REQUEST)
            assert (request.action, request.name) == (GoalListRequest.DELETE, "arch")
            expect(page.get_by_role("combobox", name="Saved goal")).to_have_value("(none)")
            expect(page.get_by_role("button", name="Set saved goal")).to_be_disabled()
    finally:
        cell.end()
        service.close()
