"""Holds, approaches and the controls of the page in a real browser, with messages from a stage."""

from __future__ import annotations

import re
from itertools import pairwise

import pytest
from playwright.sync_api import Locator, Page, expect

from shared import topics
from shared.messages import (
    ArmCommand,
    ArmStates,
    TaskRequest,
)
from tests.browser.cell import Cell
from tests.browser.chromium import NO_CHROMIUM, comes
from tests.dashboard.web.visitor import Visitor

pytestmark = [pytest.mark.live, NO_CHROMIUM]


def hold_button(page: Page) -> Locator:
    return page.locator("#stop-bar .hold")


def test_hold_is_meant_for_this_start_of_the_gateway_only(cell: tuple[Cell, Page]) -> None:
    stage, page = cell
    hold_button(page).click()
    command = stage.asked(topics.ARM_COMMAND)
    assert (command.action, command.boot) == (ArmCommand.HOLD, "boot-1")
    assert command.answers > 0


def test_hold_that_the_gateway_does_not_confirm_is_said(cell: tuple[Cell, Page]) -> None:
    stage, page = cell
    stage.deaf = True
    try:
        hold_button(page).click()
        expect(page.locator("#stop-bar")).to_contain_text("HOLD NOT CONFIRMED")
        expect(page.locator("#stop-bar")).to_contain_text("hard-wired emergency stop")
    finally:
        stage.deaf = False
    hold_button(page).click()
    expect(page.locator("#stop-bar")).not_to_contain_text("NOT CONFIRMED")
    stage.forget()


def test_hold_that_is_pressed_again_is_tried_as_often_again(cell: tuple[Cell, Page]) -> None:
    stage, page = cell
    # The attempts of an earlier press have ended.
    expect(hold_button(page)).not_to_have_class(re.compile("sent"))
    stage.forget()
    stage.deaf = True
    try:
        hold_button(page).click()
        assert comes(page, lambda: len(stage.sent(topics.ARM_COMMAND)) == 4)
        hold_button(page).click()
        assert comes(page, lambda: len(stage.sent(topics.ARM_COMMAND)) >= 4 + 5)
        expect(page.locator("#stop-bar")).to_contain_text("HOLD NOT CONFIRMED")
    finally:
        stage.deaf = False
    hold_button(page).click()
    expect(page.locator("#stop-bar")).not_to_contain_text("NOT CONFIRMED")


def test_hold_is_asked_for_by_a_request_where_the_socket_is_silent(
    cell: tuple[Cell, Page],
) -> None:
    stage, page = cell
    expect(hold_button(page)).not_to_have_class(re.compile("sent"))
    stage.forget()
    page.evaluate("() => { send = WebSocket.prototype.send; WebSocket.prototype.send = () => {} }")
    try:
        with page.expect_request("**/hold"):
            hold_button(page).click()
        assert stage.asked(topics.ARM_COMMAND).action == ArmCommand.HOLD
    finally:
        page.evaluate("() => { WebSocket.prototype.send = send }")
    page.reload()
    expect(page.locator("#stop-bar")).to_contain_text("Moving")


@pytest.mark.parametrize("key", ["Space", "Escape"])
def test_key_holds_and_does_not_press_the_button_with_the_focus(
    cell: tuple[Cell, Page], key: str
) -> None:
    stage, page = cell
    stage.forget()
    page.get_by_role("button", name="Stop", exact=True).focus()
    page.keyboard.press(key)
    assert stage.asked(topics.ARM_COMMAND).action == ArmCommand.HOLD
    with pytest.raises(AssertionError, match="nothing on"):
        stage.asked(topics.TASK_REQUEST, timeout=0.5)


def test_double_click_on_hold_does_nothing_but_hold(cell: tuple[Cell, Page]) -> None:
    stage, page = cell
    stage.forget()
    hold_button(page).click()
    # As after a hold: the gateway waits for an acknowledgement.
    stage.show_arms(mode=ArmStates.HOLDING, needs_acknowledgement=True)
    go_on = page.get_by_role("button", name="Continue")
    expect(go_on).to_be_visible()
    hold_button(page).click(click_count=2, delay=30)
    stage.show_arms(mode=ArmStates.HOLDING, needs_resume=True)
    expect(go_on).to_be_visible()
    hold_button(page).click(click_count=2, delay=30)
    page.wait_for_timeout(500)
    assert stage.actions() == {ArmCommand.HOLD}
    stage.show_arms(mode=ArmStates.MOVING)


@pytest.mark.parametrize("size", [(1440, 810), (1000, 500), (390, 700)])
def test_hold_keeps_its_place_whatever_is_open(
    cell: tuple[Cell, Page], size: tuple[int, int]
) -> None:
    stage, page = cell
    width, height = size
    page.set_viewport_size({"width": width, "height": height})
    try:
        place = hold_button(page).bounding_box()
        assert place is not None
        assert place["x"] >= 0.0
        assert place["x"] + place["width"] <= width
        assert place["y"] + place["height"] <= height
        assert place["width"] >= 280.0
        assert place["height"] >= 56.0
        for mode in (ArmStates.HOLDING, ArmStates.DISARMED):
            stage.show_arms(
                mode=mode,
                reason="a long reason " * 20,
                needs_acknowledgement=mode == ArmStates.HOLDING,
                needs_approach=mode == ArmStates.DISARMED,
                approach_distance=0.334,
            )
            page.wait_for_timeout(300)
            assert hold_button(page).bounding_box() == place
        middle = [place["x"] + place["width"] / 2.0, place["y"] + place["height"] / 2.0]
        on_top = "p => document.elementFromPoint(...p).closest('button')?.className"
        assert "hold" in page.evaluate(on_top, middle)
    finally:
        stage.show_arms(mode=ArmStates.MOVING)
        page.set_viewport_size({"width": 1440, "height": 810})


def test_approach_goes_on_only_while_its_button_is_pressed(cell: tuple[Cell, Page]) -> None:
    stage, page = cell
    stage.show_arms(mode=ArmStates.DISARMED, needs_approach=True, approach_distance=0.334)
    approach = page.locator("#stop-bar .approach")
    expect(approach).to_have_text("Approach by 334.0 mm (keep pressed)")
    stage.forget()
    approach.hover()
    page.mouse.down()
    command = stage.asked(topics.ARM_COMMAND)
    assert command.action == ArmCommand.APPROACH
    assert command.approach_distance == pytest.approx(0.334)
    assert stage.asked(topics.ARM_CONSENT).command == command.id
    page.mouse.up()
    page.wait_for_timeout(1000)
    stage.forget()
    with pytest.raises(AssertionError, match="nothing on"):
        stage.asked(topics.ARM_CONSENT, timeout=0.5)
    # Leaving the window ends it as well.
    page.mouse.down()
    assert stage.asked(topics.ARM_CONSENT)
    page.evaluate("window.dispatchEvent(new Event('blur'))")
    page.wait_for_timeout(1000)
    stage.forget()
    with pytest.raises(AssertionError, match="nothing on"):
        stage.asked(topics.ARM_CONSENT, timeout=0.5)
    page.mouse.up()
    stage.show_arms(mode=ArmStates.MOVING)


def test_window_gives_the_controls_to_another_one_and_takes_them_back(
    cell: tuple[Cell, Page],
) -> None:
    stage, page = cell
    stop = page.get_by_role("button", name="Stop", exact=True)
    other = Visitor(stage.address).enter()
    with other.open_socket("/cell") as socket:
        socket.send('{"type": "ask"}')
        page.get_by_role("button", name="Give them").click()
        expect(page.locator("#banner")).to_contain_text("Another window has the controls")
        stage.forget()
        stop.dispatch_event("click")
        with pytest.raises(AssertionError, match="nothing on"):
            stage.asked(topics.TASK_REQUEST, timeout=0.5)
        hold_button(page).click()
        assert stage.asked(topics.ARM_COMMAND).action == ArmCommand.HOLD
    page.get_by_role("button", name="Take the controls").click()
    expect(page.locator("#banner")).to_be_hidden()
    stop.click()
    assert stage.asked(topics.TASK_REQUEST).action == TaskRequest.STOP


SLOW_FRAMES = """() => new Promise((done) => {
  const frames = [];
  function draw() {
    const began = performance.now();
    while (performance.now() - began < 200);
    frames.push([began, performance.now()]);
    frames.length < 3 ? requestAnimationFrame(draw) : done(frames);
  }
  requestAnimationFrame(draw);
})"""
"""Script that draws frames of 200 ms, and returns when each began and ended [ms]."""


def test_slow_frames_leave_as_much_time_as_they_take_to_presses(cell: tuple[Cell, Page]) -> None:
    frames = cell[1].evaluate(SLOW_FRAMES)
    for (_, ended), (begins, _) in pairwise(frames):
        assert begins - ended > 190.0
