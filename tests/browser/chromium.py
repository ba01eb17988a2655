"""Debian's chromium, headless, with software rendering."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager

from playwright.sync_api import Page, sync_playwright

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


@contextmanager
def opened(url: str, width: int = 1280, height: int = 720) -> Iterator[Page]:
    """A page in a browser of its own, closed when the block ends."""
    with sync_playwright() as playwright, tempfile.TemporaryDirectory() as profile:
        context = playwright.chromium.launch_persistent_context(
            profile,
            executable_path=EXECUTABLE,
            headless=True,
            args=list(FLAGS),
            viewport={"width": width, "height": height},
        )
        # Shaders compile on one core: the first frame may take long.
        context.set_default_timeout(60_000)
        page = context.pages[0]
        try:
            page.goto(url)
            yield page
        finally:
            context.close()
