from __future__ import annotations

import threading
from collections.abc import Callable, Iterator

import pytest
from viser import UploadedFile

from dashboard.action_queue import ActionQueue
from dashboard.outbox import Notification
from dashboard.uploads import MAX_FILE_SIZE, Uploads
from tests.shared.cell import until

pytestmark = pytest.mark.live


class Page:
    """Page that reads uploads, and what came of them."""

    def __init__(self) -> None:
        self.actions = ActionQueue()
        self.notes: list[Notification] = []
        self.values: list[int] = []
        self.uploads = Uploads(self.actions, self.notes.append)

    def take(self, content: bytes, read: Callable[[bytes], int] = len) -> None:
        self.uploads.take(UploadedFile("a.csv", content), "a goal", read, self.values.append)

    def step_until(self, holds: Callable[[], object]) -> None:
        until(lambda: self.actions.run() or holds())


@pytest.fixture
def page() -> Iterator[Page]:
    page = Page()
    yield page
    page.uploads.close()


def test_file_is_read_while_steps_go_on_and_acted_on_in_a_step(page: Page) -> None:
    read, freed = threading.Event(), threading.Event()
    page.take(b"1234", lambda content: read.set() or (freed.wait(10.0) and len(content)))
    page.take(b"12")
    assert read.wait(10.0)
    page.actions.run()
    assert page.values == []
    freed.set()
    page.step_until(lambda: page.values == [4, 2])


def test_file_that_cannot_be_read_is_refused_with_the_reason(page: Page) -> None:
    def fail(content: bytes) -> int:
        raise RecursionError

    page.take(b"", fail)
    page.take(bytes(MAX_FILE_SIZE + 1))
    page.step_until(lambda: len(page.notes) == 2)
    assert page.notes[0] == Notification("a.csv: not a goal", "it is nested too deeply")
    assert page.notes[1].body == "it is larger than 128 KiB"
    assert page.values == []
