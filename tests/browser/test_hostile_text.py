"""Texts of hostile files and messages in a real browser: they are shown, and none runs."""

from __future__ import annotations

from playwright.sync_api import Page, expect

from shared import topics
from shared.messages import ScenarioEntry, StackState, TaskState
from tests.browser.cell import Cell
from tests.browser.chromium import NO_CHROMIUM

pytestmark = NO_CHROMIUM

PRESS_START = "parent.document.title='ran'"
FRAME = f'<iframe srcdoc="<script>{PRESS_START}</script>"></iframe>'
IMAGE = "<img src=x onerror=\"document.title='ran'\">"
HOSTILE = f"{FRAME}{IMAGE}\x1b[2J"


def test_texts_of_a_hostile_file_and_of_messages_are_shown_as_they_are(
    bench: tuple[Cell, Page],
) -> None:
    stage, page = bench
    title = page.title()
    entry = ScenarioEntry(name="hostile", description=HOSTILE, own=True)
    stage.stack = StackState(scenario=HOSTILE, activity="", refusal=HOSTILE, scenarios=[entry])
    stage.say(topics.TASK_STATE, TaskState(refusal=HOSTILE, reason=HOSTILE))
    page.get_by_role("tab", name="Scenario").click()
    expect(page.get_by_text("<iframe srcdoc").first).to_be_visible()
    text = f"[ends.left]\naddress = '''{FRAME}{IMAGE}'''\n"
    file = {"name": "<b>file.toml", "mimeType": "text/plain", "buffer": text.encode()}
    with page.expect_file_chooser() as chooser:
        page.get_by_role("button", name="Start a file …").click()
    chooser.value.set_files(file)
    expect(page.get_by_role("button", name="Start real arms")).to_be_visible()
    expect(page.get_by_text("It drives the real arms at <iframe").first).to_be_visible()
    page.wait_for_timeout(500)
    assert page.locator("iframe").count() == 0
    assert page.title() == title
    page.get_by_role("button", name="Cancel").click()


def test_script_that_were_in_the_page_all_the_same_would_not_run(bench: tuple[Cell, Page]) -> None:
    _, page = bench
    title = page.title()
    page.evaluate(
        "html => document.body.insertAdjacentHTML('beforeend', html)",
        FRAME + IMAGE + "<a id=link href=\"javascript:document.title='ran'\">link</a>",
    )
    page.evaluate("document.getElementById('link').click()")
    page.wait_for_timeout(1000)
    assert page.title() == title
    page.evaluate("for (const e of document.querySelectorAll('iframe,#link')) e.remove()")
