"""Debian's chromium, headless, with software rendering."""

from __future__ import annotations

import re
import shutil
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from jaxtyping import Float64
from playwright.sync_api import Locator, Page, TimeoutError, expect, sync_playwright

from dashboard.scene.scene_setup import initial_viewpoint
from lariat.geometry.cameras import Camera, Intrinsics, looking_at
from lariat.scenario import Scenario

EXECUTABLE = shutil.which("chromium")
FLAGS = (
    "--headless=new",
    "--no-sandbox",
    "--disable-gpu",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
)


# Longest wait for what a page shows [ms]: rendering takes the processor from all else.
expect.set_options(timeout=60_000)

NO_CHROMIUM = pytest.mark.skipif(EXECUTABLE is None, reason="chromium is not installed")


@contextmanager
def opened(url: str, width: int = 1440, height: int = 810, *, niceness: int = 0) -> Iterator[Page]:
    """Open a page in a browser of its own, closed when the block ends.

    Args:
        url: Address of the page.
        width: Width of the window [pixels].
        height: Height of the window [pixels].
        niceness: Niceness of the browser, which without a graphics card takes every core.
    """
    with sync_playwright() as playwright, tempfile.TemporaryDirectory() as folder:
        wrapper = Path(folder, "chromium")
        wrapper.write_text(f'#!/bin/sh\nexec nice -n {niceness} {EXECUTABLE} "$@"\n')
        wrapper.chmod(0o755)
        context = playwright.chromium.launch_persistent_context(
            Path(folder, "profile"),
            executable_path=wrapper,
            headless=True,
            args=list(FLAGS),
            viewport={"width": width, "height": height},
        )
        context.set_default_timeout(60_000)
        page = context.pages[0]
        try:
            page.goto(url)
            # Only without a graphics card, and it covers what tests want to touch.
            notice = page.get_by_role("alert").filter(has_text="Software WebGL")
            notice.get_by_role("button").click(timeout=60_000)
            notice.wait_for(state="detached")
            yield page
        finally:
            context.close()


def field(page: Page, label: str) -> Locator:
    """Return the input of a labelled field."""
    return page.get_by_text(label, exact=True).locator("xpath=ancestor::*[.//input][1]//input")


def on_screen(
    page: Page, scenario: Scenario, point: Float64[np.ndarray, "3"]
) -> Float64[np.ndarray, "2"]:
    """Return the place of a point [m] in the window [pixels], in the first view."""
    canvas = page.locator("canvas").first.bounding_box()
    assert canvas is not None
    width, height = canvas["width"], canvas["height"]
    viewpoint = initial_viewpoint(scenario)
    f = height / 2.0 / np.tan(viewpoint.field_of_view / 2.0)
    camera = Camera(
        Intrinsics(round(width), round(height), f, f, width / 2.0, height / 2.0),
        looking_at(tuple(viewpoint.position), tuple(viewpoint.target)),
    )
    return camera.project(point)[0] + np.array([canvas["x"], canvas["y"]])


TWO_FRAMES = "() => new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))"
"""Script that ends when the page has been drawn twice."""
SENT = "() => new Promise(done => setTimeout(done, 100))"
"""Script that ends when the page has sent its newest value: it sends one every 50 ms of its own
time, the last one of those that come meanwhile."""


def drag(page: Page, start: Float64[np.ndarray, "2"], end: Float64[np.ndarray, "2"]) -> None:
    """Drag from one place of the window to another [pixels], in steps like those of a hand.

    Notices, which lie above the scene for a while, are waited for.
    """
    expect(page.locator(".mantine-Notification-root")).to_have_count(0)
    page.mouse.move(*(start - 3.0))
    page.mouse.move(*start)
    page.wait_for_timeout(400)
    # A gizmo puts the plane in which it is dragged right when it is drawn.
    page.evaluate(TWO_FRAMES)
    page.mouse.down()
    page.wait_for_timeout(300)
    page.evaluate(TWO_FRAMES)
    for t in np.linspace(0.0, 1.0, 9)[1:]:
        page.mouse.move(*((1.0 - t) * start + t * end))
        page.wait_for_timeout(60)
    page.wait_for_timeout(300)
    page.mouse.up()


def comes(page: Page, holds: Callable[[], bool]) -> bool:
    """Whether something comes to hold within 60 s; a page is drawn when its machine has time."""
    for _ in range(240):
        if holds():
            return True
        page.wait_for_timeout(250)
    return False


def choose(page: Page, box: str, option: str) -> None:
    """Choose an option of a list, which opens when its machine has time."""
    entry = page.get_by_role("option", name=option)
    combobox = page.get_by_role("combobox", name=box, exact=True)
    for _ in range(5):
        combobox.click()
        try:
            entry.click(timeout=12_000)
            expect(combobox).to_have_value(re.compile(re.escape(option)), timeout=3_000)
        except (TimeoutError, AssertionError):
            # The page hides a list whose box was moved out of view, and a click on a list that
            # changes at that moment is lost; this closes it.
            combobox.press("Tab")
        else:
            page.evaluate(SENT)
            return
    raise AssertionError(f"the list {box!r} shows no {option!r}")


def press_set_goal(page: Page) -> None:
    """Press "Set goal" until the editor closes.

    A move of a drag that is still on its way disables the button under the pointer.
    """
    button = page.get_by_role("button", name="Set goal")
    for _ in range(5):
        button.click()
        try:
            button.wait_for(state="hidden", timeout=12_000)
        except TimeoutError:
            continue
        return
    raise AssertionError('"Set goal" does not close the editor')
