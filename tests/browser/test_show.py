"""A recording in a real browser."""

from __future__ import annotations

import re
import subprocess
import sys
import time
from pathlib import Path

from playwright.sync_api import expect

from tests.browser.chromium import NO_CHROMIUM, opened
from tests.browser.stack import free_port
from tests.cli.test_show import record

pytestmark = NO_CHROMIUM


def test_recording_plays_and_can_be_scrubbed(tmp_path: Path) -> None:
    port = free_port()
    file = record(tmp_path / "run.mcap", seconds=3.0)
    command = [sys.executable, "-m", "cli", "show", str(file), "--port", str(port)]
    process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
    try:
        assert process.stderr is not None
        words = process.stderr.readline().split()
        address = next(word for word in words if word.startswith(f"http://127.0.0.1:{port}"))
        with opened(address, 1000, 600) as page:
            expect(page.locator("#stop-bar")).to_have_count(0)
            # By now it has come to its end and waits there.
            expect(page.get_by_role("button", name="Play")).to_be_visible()
            expect(page.get_by_text(re.compile(r"^Running: "))).to_be_visible()
            assert page.get_by_role("button", name="Start").count() == 0
            last = page.get_by_text(re.compile(r"^Running: ")).inner_text()
            time_field = page.get_by_role("textbox").first
            time_field.fill("0.5")
            time_field.press("Enter")
            expect(page.get_by_text(last)).to_have_count(0)
            page.get_by_role("button", name="Play").click()
            expect(page.get_by_role("button", name="Pause")).to_be_visible()
    finally:
        process.terminate()
        started = time.monotonic()
        process.wait(5.0)
        assert time.monotonic() - started < 5.0
