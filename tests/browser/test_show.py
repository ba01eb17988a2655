"""A recording in a real browser."""

from __future__ import annotations

import re
import subprocess
import sys
import time
from pathlib import Path

import cv2
import numpy as np
from playwright.sync_api import Page, expect

from lariat.arms.installation import kinematics_of
from lariat.scenario import load
from shared.runtime.free_port import free_port
from tests.browser.chromium import NO_CHROMIUM, comes, on_screen, opened
from tests.cli.test_show import Silent, record
from tests.dashboard.stage import Stage

pytestmark = NO_CHROMIUM

SCENARIO = load("fixed-end")
STEPS = 30
"""Moments of the recording, 0.1 s apart."""
MARGIN = 12.0
"""Distance from the edge of the scene within which nothing is looked for [pixels]."""
FREE_DISTANCE = 0.15
"""Distance from the grip beyond which nothing but the arm moves [m]."""


def places_of_the_arm(page: Page, step: int) -> np.ndarray:
    """Places of the arm's links in the window at a moment of the recording [pixels].

    NaN stands for those so near to the grip that rope or gripper may be seen there.
    """
    stage = Stage(Silent(), SCENARIO)  # pyright: ignore[reportArgumentType]
    arm = stage.arms(stage.nodes((step + 1e-3) / STEPS)).arms[1]
    kinematics = kinematics_of(SCENARIO, "right")
    assert kinematics is not None
    links = kinematics.link_spheres(np.array([arm.joints]))[0][0]
    places = np.array([on_screen(page, SCENARIO, link) for link in links])
    near = np.linalg.norm(links - np.array(arm.position), axis=1) < FREE_DISTANCE
    return np.where(near[:, None], np.nan, places)


def picture(page: Page, place: np.ndarray) -> np.ndarray:
    """Colours of the window about a place [pixels]."""
    clip = {"x": place[0] - 4.0, "y": place[1] - 4.0, "width": 8.0, "height": 8.0}
    image = cv2.imdecode(np.frombuffer(page.screenshot(clip=clip), np.uint8), 1)
    assert image is not None
    return image.astype(float)


def seek(page: Page, seconds: float) -> None:
    """Type a time of the recording."""
    time_field = page.get_by_role("textbox").first
    time_field.fill(f"{seconds:g}")
    time_field.press("Enter")


def test_recording_plays_and_can_be_scrubbed(tmp_path: Path) -> None:
    port = free_port()
    file = record(tmp_path / "run.mcap", seconds=0.1 * STEPS, scenario=SCENARIO)
    command = [sys.executable, "-m", "cli", "show", str(file), "--port", str(port)]
    process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
    try:
        assert process.stderr is not None
        words = process.stderr.readline().split()
        address = next(word for word in words if word.startswith(f"http://127.0.0.1:{port}"))
        with opened(address) as page:
            expect(page.locator("#stop-bar")).to_have_count(0)
            # By now it has come to its end and waits there.
            expect(page.get_by_role("button", name="Play")).to_be_visible()
            expect(page.get_by_text(re.compile(r"^Running: "))).to_be_visible()
            assert page.get_by_role("button", name="Start").count() == 0
            last = page.get_by_text(re.compile(r"^Running: ")).inner_text()
            check_that_software_draws_plainly(page)
            check_that_the_arm_moves(page)
            seek(page, 0.5)
            expect(page.get_by_text(last)).to_have_count(0)
            page.get_by_role("button", name="Play").click()
            expect(page.get_by_role("button", name="Pause")).to_be_visible()
    finally:
        process.terminate()
        started = time.monotonic()
        process.wait(5.0)
        assert time.monotonic() - started < 5.0


def check_that_software_draws_plainly(page: Page) -> None:
    """Look at the scene's drawing, which has no graphics card here, and count pictures in 2 s."""
    attributes = "canvas => canvas.getContext('webgl2').getContextAttributes().antialias"
    assert page.locator("canvas[data-engine]").evaluate(attributes) is False
    count = """async () => {
        let drawn = 0;
        const next = () => { drawn++; requestAnimationFrame(next); };
        // However long the first picture takes.
        await new Promise(requestAnimationFrame);
        requestAnimationFrame(next);
        await new Promise((done) => setTimeout(done, 2000));
        return drawn;
    }"""
    assert page.evaluate(count) <= 21


def check_that_the_arm_moves(page: Page) -> None:
    """Look where a link stands at the begin only, and at the background, at both ends."""
    canvas = page.locator("canvas").first.bounding_box()
    assert canvas is not None
    corner = np.array([canvas["x"], canvas["y"]]) + MARGIN
    opposite = corner + np.array([canvas["width"], canvas["height"]]) - 2.0 * MARGIN
    first, last = (places_of_the_arm(page, step) for step in (0, STEPS - 1))
    # Of the links in view, the one that is farthest from where any is at the end.
    gaps = np.linalg.norm(first[:, None] - last[None], axis=2)
    alone = np.min(np.where(np.isnan(gaps), np.inf, gaps), axis=1)
    in_view = np.all((first > corner) & (first < opposite), axis=1)
    link = first[np.argmax(np.where(in_view, alone, 0.0))]
    without, background = picture(page, link), picture(page, corner)
    seek(page, 0.0)
    assert comes(page, lambda: np.abs(picture(page, link) - without).mean() > 20.0), link
    assert np.abs(picture(page, corner) - background).mean() < 2.0
    seek(page, 0.1 * (STEPS - 1))
    assert comes(page, lambda: np.abs(picture(page, link) - without).mean() < 2.0), link
