from __future__ import annotations

import json
import threading
from collections.abc import Callable, Iterator

import pytest
from viser import UploadedFile

from dashboard.action_queue import ActionQueue
from dashboard.controls.hold_path import HoldPath
from dashboard.controls.stop_bar import StopBar
from dashboard.options import DashboardOptions
from dashboard.outbox import Notification, Outbox
from dashboard.uploads import MAX_FILE_SIZE, Uploads
from dashboard.web.site import Site
from lariat.files.toml_text import parse_toml
from shared.messages import ArmStates
from shared.runtime.free_port import free_port
from tests.dashboard.web.visitor import Visitor
from tests.shared.cell import until

pytestmark = pytest.mark.live

WORST_FILES = (
    "a=[" + "1," * (MAX_FILE_SIZE // 2 - 8) + "]",
    "a=[" + "{b=1}," * (MAX_FILE_SIZE // 6 - 8) + "]",
    "a=[" + f"{'[' * 30}{']' * 30}," * (MAX_FILE_SIZE // 61 - 8) + "]",
    'a="""' + "x" * (MAX_FILE_SIZE - 16) + '"""',
    "[[a]]\n" * (MAX_FILE_SIZE // 6 - 8),
)
"""Files of the largest size that take the parser longest, in whole or in one call."""


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
    assert page.notes[0].title.startswith("a.csv")
    assert "nested" in page.notes[0].body
    assert "128 KiB" in page.notes[1].body
    assert page.values == []


def test_hold_is_confirmed_while_the_worst_files_are_read(page: Page) -> None:
    path = HoldPath("dashboard-ab")
    path.connect(lambda command: path.take(ArmStates(last_command=command.id)))
    site = Site(DashboardOptions(port=free_port()), "test", StopBar(Outbox("dashboard-ab"), path))
    try:
        with Visitor(site.address).enter().open_socket("/cell") as socket:
            for text in 2 * WORST_FILES:
                page.take(text.encode(), lambda content: len(parse_toml(content.decode())))
            holds = 0
            while len(page.values) < 2 * len(WORST_FILES):
                page.actions.run()
                socket.send('{"type": "hold", "number": 1}')
                assert json.loads(socket.recv(5.0))["answer"]["confirmed"]
                holds += 1
    finally:
        site.close()
    assert holds > 5, "no hold was pressed while a file was read"
