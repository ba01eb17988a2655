"""Take docs/guide/dashboard.png, the README's picture: `python -m tests.browser.picture`."""

from __future__ import annotations

import re
from pathlib import Path

import tyro
from playwright.sync_api import expect

from tests.browser.chromium import opened
from tests.browser.stack import running


def main(
    file: Path = Path("docs/guide/dashboard.png"),
    scenario: str = "scenarios/three-cylinders.toml",
    seconds: float = 1.5,
) -> None:
    """Start the stack, press Start and take the picture.

    Args:
        file: File to write, a PNG.
        scenario: Scenario to run.
        seconds: Time from Start to the picture [s].
    """
    with running(scenario) as address, opened(address, 1600, 900, niceness=19) as page:
        ready = page.get_by_text(re.compile(r"^Ready: "))
        expect(ready).to_be_visible(timeout=30_000)
        page.wait_for_timeout(3000)
        page.get_by_role("button", name="Start").click()
        page.wait_for_timeout(1e3 * seconds)
        page.screenshot(path=file)


if __name__ == "__main__":
    tyro.cli(main)
