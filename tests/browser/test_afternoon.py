"""Tasks of an afternoon at the page in a real browser: explain a hold, read estimates and times,
edit obstacles, return to a goal, export a run; and the page before anything is started.

What is asked for is done by mouse and keyboard.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np
import pytest
from foxglove_schemas_protobuf.Log_pb2 import Log
from playwright.sync_api import Page, expect

from lariat.scenario.rod_properties import rod_properties
from lariat.trajectory import SECOND
from shared import topics
from shared.messages import (
    ArmStates,
    Goal,
    RunList,
    RunListRequest,
    RunSummary,
    Scene,
    SceneRequest,
    TaskRequest,
    chain,
    obstacle_message,
)
from tests.browser.cell import SCENARIO, Cell, opened_cell
from tests.browser.chromium import NO_CHROMIUM, choose, comes, field

pytestmark = NO_CHROMIUM


@pytest.fixture(scope="module")
def bench() -> Iterator[tuple[Cell, Page]]:
    with opened_cell(dead=True) as both:
        yield both


@pytest.fixture
def started(bench: tuple[Cell, Page]) -> tuple[Cell, Page]:
    """The page of a cell that runs."""
    cell, page = bench
    cell.dead = False
    expect(page.get_by_text("Running:")).to_be_visible()
    return cell, page


def open_tab(page: Page, name: str) -> None:
    page.get_by_role("tab", name=name, exact=True).click()


def test_page_before_any_start_names_what_is_missing(bench: tuple[Cell, Page]) -> None:
    cell, page = bench
    expect(page.get_by_text("Connecting …").first).to_be_visible()
    missing = page.get_by_text("Nothing is heard from: sim, perception, planner, controller")
    expect(missing).to_contain_text("lariat up starts them all")
    expect(page.get_by_role("button", name="Start", exact=True)).to_be_hidden()
    cell.dead = False
    expect(page.get_by_text("Running:")).to_be_visible()
    expect(missing).to_be_hidden()


def test_hold_is_explained_and_events_are_filtered(started: tuple[Cell, Page]) -> None:
    cell, page = started
    open_tab(page, "Events")
    stop = page.get_by_role("button", name="Stop", exact=True)
    before = stop.bounding_box()
    cell.say(topics.LOG.at("sim"), Log(level=Log.Level.INFO, name="sim", message="lab is ready"))
    cell.say(topics.LOG.at("planner"), Log(level=Log.Level.ERROR, name="planner", message="no way"))
    cell.show_arms(
        mode=ArmStates.HOLDING,
        reason="setpoints stopped",
        rule="fresh",
        needs_acknowledgement=True,
    )
    for text in ("lab is ready", "no way", "setpoints stopped (rule fresh)"):
        expect(page.get_by_text(text).first).to_be_visible()
    todo = page.get_by_text("Controller, bus or machine were too slow: see the tab Health")
    expect(todo.first).to_be_visible()
    # The headline has become longer; the buttons of the run have not moved.
    expect(page.get_by_text("Held: ")).to_be_visible()
    assert stop.bounding_box() == before
    choose(page, "Level", "Warnings")
    expect(page.get_by_text("lab is ready")).to_have_count(0)
    expect(todo.first).to_be_visible()
    choose(page, "Level", "Errors")
    expect(todo).to_have_count(0)
    expect(page.get_by_text("no way")).to_be_visible()
    choose(page, "Level", "Everything")
    words = field(page, "Find")
    words.fill("PLANNER")
    expect(page.get_by_text("lab is ready")).to_have_count(0)
    expect(page.get_by_text("no way")).to_be_visible()
    words.fill("")
    expect(page.get_by_text("lab is ready")).to_be_visible()
    cell.show_arms(mode=ArmStates.MOVING)


def test_estimate_is_drawn_with_its_deviation_and_the_true_value(
    started: tuple[Cell, Page],
) -> None:
    cell, page = started
    open_tab(page, "Rope")
    expect(page.get_by_role("cell", name="bending stiffness")).to_be_visible()
    find = (
        "Object.values(window.__viserTestpoints.uplots ?? {}).map(u => u.chart)"
        ".find(c => c.series.some(s => s.label === 'true value (simulation)'))"
    )
    newest = f"{find}?.data.slice(1, 5).map(row => row[1])"
    truth = rod_properties(SCENARIO.plant_rope).bending_stiffness
    wanted = truth * np.array([1.0, 1.06, 1.06 + 0.09, 1.06 - 0.09])

    def is_drawn() -> bool:
        values = page.evaluate(newest)
        return values is not None and None not in values and np.allclose(values, wanted, rtol=1e-3)

    assert comes(page, is_drawn), page.evaluate(newest)
    # Another parameter takes its place, with its own true value.
    length = SCENARIO.plant_rope.length
    choose(page, "Over time", "length")
    expect(page.get_by_text("length [m]")).to_be_visible()
    wanted = np.array([length, 1.01 * length, 1.01 * length + 0.002, 1.01 * length - 0.002])
    assert comes(page, is_drawn), page.evaluate(newest)
    # Whether the rope is estimated may be changed while a run goes on.
    cell.forget()
    page.get_by_role("checkbox", name="Adapt").click()
    request = cell.asked(topics.TASK_REQUEST)
    assert (request.action, request.key, request.value) == (TaskRequest.SET, "adapt", "true")


def test_costs_step_times_and_ages_are_shown(started: tuple[Cell, Page]) -> None:
    _, page = started
    open_tab(page, "Run")
    expect(page.get_by_text("Cost of the horizon by term")).to_be_visible()
    row = page.get_by_role("row").filter(has=page.get_by_role("cell", name="clearance", exact=True))
    expect(row).to_contain_text("1")
    open_tab(page, "Health")
    controller = page.get_by_role("row").filter(
        has=page.get_by_role("cell", name="controller", exact=True)
    )
    expect(controller.first).to_contain_text("4.2 / 9.1")
    expect(controller.first).to_contain_text("20")
    age = page.get_by_role("row").filter(has=page.get_by_role("cell", name="rope/nodes"))
    expect(age).to_contain_text("33 ms")
    open_tab(page, "Run")


def test_obstacle_is_duplicated_resized_removed_and_all_is_undone(
    started: tuple[Cell, Page],
) -> None:
    cell, page = started
    cell.forget()
    folder = page.get_by_text("Obstacles", exact=True)
    folder.click()
    choose(page, "Selected", "middle")
    page.get_by_role("button", name="Duplicate").click()
    request = cell.asked(topics.SCENE_REQUEST)
    assert (request.action, request.obstacle.name) == (SceneRequest.ADD, "middle-copy-1")
    # The scenario's own keeps its size; what was added is selected and may have another.
    expect(page.get_by_text("Size [mm]", exact=True)).to_have_count(1)
    own = [obstacle_message(b) for b in SCENARIO.bodies]
    cell.scene = Scene(revision=2, obstacles=[*own, request.obstacle])
    selected = page.get_by_role("combobox", name="Selected", exact=True)
    expect(selected).to_have_value("middle-copy-1")
    size = field(page, "Size [mm]").first
    wanted = 2.0 * float(size.input_value()) + 10.0
    size.fill(f"{wanted:g}")
    size.press("Tab")
    request = cell.asked(topics.SCENE_REQUEST)
    assert (request.action, request.obstacle.name) == (SceneRequest.RESIZE, "middle-copy-1")
    assert comes(
        page,
        lambda: any(
            2e3 * m.obstacle.radius == pytest.approx(wanted)
            for m in [request, *cell.sent(topics.SCENE_REQUEST)]
            if m.action == SceneRequest.RESIZE
        ),
    )
    cell.forget()
    page.get_by_role("button", name="Remove").click()
    request = cell.asked(topics.SCENE_REQUEST)
    assert (request.action, request.obstacle.name) == (SceneRequest.REMOVE, "middle-copy-1")
    undo = page.get_by_role("button", name="Undo obstacle")
    undone: list[SceneRequest] = []
    while undo.is_visible() and len(undone) < 10:
        undo.click()
        undone.append(cell.asked(topics.SCENE_REQUEST))
        page.wait_for_timeout(300)
    assert undone[0].action == SceneRequest.ADD
    assert {m.action for m in undone[1:-1]} == {SceneRequest.RESIZE}
    middle = next(b for b in SCENARIO.bodies if b.name == "middle")
    assert undone[-2].obstacle.radius == pytest.approx(middle.radius)
    assert (undone[-1].action, undone[-1].obstacle.name) == (SceneRequest.REMOVE, "middle-copy-1")
    choose(page, "Selected", "–")
    folder.click()
    cell.scene = None


def test_present_shape_becomes_the_goal_and_is_undone(started: tuple[Cell, Page]) -> None:
    cell, page = started
    cell.forget()
    first = cell.goal()
    page.get_by_role("button", name="Present shape as goal").click()
    request = cell.asked(topics.TASK_REQUEST)
    assert request.action == TaskRequest.SET_GOAL
    assert chain(request.goal.positions) == pytest.approx(cell.rope(), abs=1e-9)
    undo = page.get_by_role("button", name="Undo goal")
    expect(undo).to_be_hidden()
    cell.set_goal(request.goal)
    expect(undo).to_be_visible()
    undo.click()
    returned: Goal = cell.asked(topics.TASK_REQUEST).goal
    assert chain(returned.positions) == pytest.approx(chain(first.positions), abs=1e-9)
    cell.set_goal(first)
    expect(undo).to_be_hidden()


def test_run_is_starred_and_its_curves_are_exported(started: tuple[Cell, Page]) -> None:
    cell, page = started
    run = RunSummary(id="run-1", scenario="rope", run="run-1", started=SECOND, over=True, bytes=9)
    cell.runs = RunList(stamp=1, runs=[run])
    open_tab(page, "Runs")
    choose(page, "Run", "run-1")
    cell.forget()
    page.get_by_role("button", name="Star", exact=True).click()
    request = cell.asked(topics.RUN_LIST_REQUEST)
    assert (request.action, request.star) == (RunListRequest.ANNOTATE, True)
    with page.expect_download() as download:
        page.get_by_role("button", name="Export CSV").click()
    lines = Path(download.value.path()).read_text().splitlines()
    assert len(lines) > 10
    assert "clearance" in lines[0]
    cell.runs = None
    open_tab(page, "Run")


def test_everything_is_framed_again_after_the_view_was_lost(started: tuple[Cell, Page]) -> None:
    _, page = started
    canvas = page.locator("canvas[data-engine]").bounding_box()
    assert canvas is not None
    # What earlier tests have asked for and nobody answered lies above the scene for a while.
    expect(page.locator(".mantine-Notification-root")).to_have_count(0)
    clip = {
        "x": canvas["x"] + 0.3 * canvas["width"],
        "y": canvas["y"] + 0.2 * canvas["height"],
        "width": 0.4 * canvas["width"],
        "height": 0.4 * canvas["height"],
    }

    def picture() -> np.ndarray:
        image = cv2.imdecode(np.frombuffer(page.screenshot(clip=clip), np.uint8), 1)
        assert image is not None
        return image.astype(float)

    def framed() -> np.ndarray:
        # Turns of the wheel that a slow browser has yet to handle move the view after a click.
        frame.click()
        page.wait_for_timeout(2000)
        return picture()

    def difference(before: np.ndarray) -> float:
        return float(np.abs(picture() - before).mean())

    folder = page.get_by_text("View", exact=True)
    folder.click()
    frame = page.get_by_role("button", name="Frame everything")
    views = [framed()]

    def settles() -> bool:
        views.append(framed())
        return float(np.abs(views[-1] - views[-2]).mean()) < 0.5

    def returns() -> bool:
        assert comes(page, settles), "the view does not settle"
        page.mouse.move(clip["x"] + clip["width"] / 2.0, clip["y"] + clip["height"] / 2.0)
        for _ in range(10):
            page.mouse.wheel(0.0, -300.0)
            page.wait_for_timeout(100)
        assert comes(page, lambda: difference(views[-1]) > 10.0), "the wheel moves no view"
        return any(float(np.abs(framed() - views[-1]).mean()) < 3.0 for _ in range(10))

    # On a slow machine the scene may have changed since the first view settled.
    assert any(returns() for _ in range(3))
    folder.click()
