"""Page as a workbench in a real browser: scenarios and settings, campaigns, goals, first steps.

What is asked for is done by mouse and keyboard.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from playwright.sync_api import Page, expect

from lariat.trajectory import SECOND
from shared import topics
from shared.messages import (
    CampaignState,
    CampaignTrial,
    GoalListRequest,
    RunList,
    RunListRequest,
    RunSummary,
    RunVideo,
    ScenarioEntry,
    StackRequest,
    StackState,
    TaskRequest,
    chain,
)
from tests.browser.cell import SCENARIO, Cell
from tests.browser.chromium import (
    NO_CHROMIUM,
    choose,
    comes,
    drag,
    field,
    on_screen,
    press_set_goal,
)

pytestmark = NO_CHROMIUM


def test_settings_are_checked_started_and_saved(bench: tuple[Cell, Page]) -> None:
    cell, page = bench
    entries = [
        ScenarioEntry(name="fixed-end", description="One end is fixed."),
        ScenarioEntry(name="lab", description="Ours.", own=True, real_arms=["10.0.0.6"]),
    ]
    cell.stack = StackState(scenario="three-cylinders", scenarios=entries)
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
    expect(page.get_by_text("saved as mine")).to_be_visible()
    # A scenario with real arms is started by a button that says so.
    choose(page, "Scenario", "lab")
    expect(page.get_by_text("Ours.")).to_be_visible()
    start.click()
    dialog = page.get_by_role("dialog")
    expect(dialog).to_contain_text("It drives the real arms at 10.0.0.6")
    dialog.get_by_role("button", name="Start real arms").click()
    request = cell.asked(topics.STACK_REQUEST)
    assert (request.scenario, list(request.confirmed)) == ("lab", ["10.0.0.6"])
    # A connection that is lost meanwhile is no reason to worry.
    cell.stack.activity = "checking lab"
    lose = """() => {
      window.dispatchEvent(new CustomEvent("lariat-lost"));
      return document.querySelector("#banner").textContent;
    }"""
    assert comes(page, lambda: "Another cell starts" in page.evaluate(lose))
    expect(page.locator("#banner")).to_be_hidden()
    # Without a launcher, the page says what is missing.
    cell.stack = None
    expect(page.get_by_text("Nobody who starts scenarios answers")).to_be_visible()
    expect(start).to_be_disabled()


def test_campaign_is_run_watched_canceled_and_downloaded(bench: tuple[Cell, Page]) -> None:
    cell, page = bench
    cell.stack = StackState(scenario="three-cylinders", scenarios=[ScenarioEntry(name="rope")])
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
    expect(page.get_by_text("Nobody who runs campaigns answers")).to_be_visible()


def test_runs_are_chosen_by_words_and_compared_together(bench: tuple[Cell, Page]) -> None:
    cell, page = bench
    started = 1_790_000_000 * SECOND
    runs = [
        RunSummary(
            id=f"run-{k}",
            run=f"run-{k}",
            scenario="three-cylinders",
            started=started + k * SECOND,
            over=True,
            note=f"2026_table: seed {k}" if k < 2 else "",
        )
        for k in range(3)
    ]
    cell.runs = RunList(stamp=1, runs=runs)
    page.get_by_role("tab", name="Runs", exact=True).click()
    rows = page.locator("tr:not(.u-series)").filter(has_text="three-cylinders")
    expect(rows).to_have_count(3)
    words = field(page, "Show")
    words.fill("2026_TABLE seed")
    words.press("Enter")
    expect(rows).to_have_count(2)
    page.get_by_role("button", name="Compare the shown ones").click()
    request = cell.asked(topics.RUN_LIST_REQUEST)
    assert request.action == RunListRequest.SEND_CURVES
    assert list(request.runs) == ["run-0", "run-1"]
    # The charts show the runs from their start to their end.
    expect(page.locator(".u-legend").first).to_contain_text("run-1")
    ends = "Object.values(window.__viserTestpoints.uplots ?? {}).map(u => u.chart.scales.x.max)"
    assert comes(
        page, lambda: np.sum(np.isclose(np.array(page.evaluate(ends), float), 2.0)) == 2
    ), f"the time axes end at {page.evaluate(ends)} s"
    words.fill("")
    words.press("Enter")
    expect(rows).to_have_count(3)


def test_video_shows_its_progress_is_canceled_and_downloaded(bench: tuple[Cell, Page]) -> None:
    cell, page = bench
    run = RunSummary(id="run-1", scenario="rope", run="run-1", started=SECOND, over=True, bytes=9)
    cell.runs = RunList(stamp=2, runs=[run])
    page.get_by_role("tab", name="Runs", exact=True).click()
    make = page.get_by_role("button", name="Make video (MP4)")
    choose(page, "Run", "(none)")
    expect(make).to_be_disabled()
    choose(page, "Run", "run-1")
    expect(make).to_be_enabled()
    cell.forget()
    make.click()
    request = cell.asked(topics.RUN_LIST_REQUEST)
    assert (request.action, list(request.runs)) == (RunListRequest.MAKE_VIDEO, ["run-1"])
    cell.video = RunVideo(run="run-1", progress=0.4)
    page.get_by_role("button", name="Video: 40 % (cancel)").click()
    request = cell.asked(topics.RUN_LIST_REQUEST)
    assert (request.action, list(request.runs)) == (RunListRequest.CANCEL_VIDEO, ["run-1"])
    cell.video = RunVideo(run="run-1", failure="it was canceled")
    expect(page.get_by_text("No video of run-1").first).to_be_visible()
    cell.video = None
    make.click()
    with page.expect_download() as download:
        cell.video = RunVideo(run="run-1", progress=1.0, data=b"moving pictures")
    assert download.value.suggested_filename == "run-1.mp4"
    assert Path(download.value.path()).read_bytes() == b"moving pictures"
    cell.video = None


def test_goal_is_saved_set_again_downloaded_and_deleted(bench: tuple[Cell, Page]) -> None:
    cell, page = bench
    wanted = cell.goal()
    page.get_by_text("Saved goals").click()
    name = field(page, "Goal name")
    name.fill("arch")
    name.press("Tab")
    page.get_by_role("button", name="Save goal").click()
    request = cell.asked(topics.GOAL_LIST_REQUEST)
    assert (request.action, request.name) == (GoalListRequest.SAVE, "arch")
    assert request.goal == wanted
    expect(page.get_by_role("button", name="Set saved goal")).to_be_disabled()
    choose(page, "Saved goal", "arch")
    page.get_by_role("button", name="Set saved goal").click()
    request = cell.asked(topics.TASK_REQUEST)
    assert (request.action, request.goal) == (TaskRequest.SET_GOAL, wanted)
    with page.expect_download() as download:
        page.get_by_role("button", name="Download goal (CSV)").click()
    assert download.value.suggested_filename == "arch.csv"
    table = np.loadtxt(Path(download.value.path()), delimiter=",")
    assert table == pytest.approx(chain(wanted.positions), abs=1e-6)
    page.get_by_role("button", name="Delete goal …").click()
    page.get_by_role("dialog").get_by_role("button", name="Delete").click()
    request = cell.asked(topics.GOAL_LIST_REQUEST)
    assert (request.action, request.name) == (GoalListRequest.DELETE, "arch")
    expect(page.get_by_role("combobox", name="Saved goal")).to_have_value("(none)")
    expect(page.get_by_role("button", name="Set saved goal")).to_be_disabled()


def test_goal_is_pulled_at_a_node(bench: tuple[Cell, Page]) -> None:
    cell, page = bench
    cell.forget()
    page.get_by_role("button", name="Edit goal").click()
    expect(page.get_by_text("Drag an end or the middle.")).to_be_visible()
    middle = chain(cell.goal().positions)[SCENARIO.rope.node_count // 2]
    # The arrow along the world's z, which points up in the window.
    start = on_screen(page, SCENARIO, middle + np.array([0.0, 0.0, 0.05]))
    drag(page, start, start - np.array([0.0, 60.0]))
    assert comes(page, lambda: any(m.pull for m in cell.sent(topics.TASK_GOAL_DRAFT)))
    press_set_goal(page)
    goal = cell.asked(topics.TASK_REQUEST).goal
    drafts = [m for m in cell.sent(topics.TASK_GOAL_DRAFT) if m.pull]
    assert {m.node for m in drafts} == {SCENARIO.rope.node_count // 2}
    pulled = np.array(drafts[-1].pull)
    assert pulled[2] > middle[2] + 0.02
    found = chain(goal.positions)[SCENARIO.rope.node_count // 2]
    assert found == pytest.approx(pulled, abs=2e-3)
    assert goal.left.position[2] > cell.goal().left.position[2] + 0.02
