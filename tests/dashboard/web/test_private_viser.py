from __future__ import annotations

import asyncio
import os
import subprocess
import sys
import threading
from collections import deque
from collections.abc import Iterator

import pytest

from dashboard.web.private_viser import PrivateViser
from tests.dashboard.web.listeners import tcp_listeners

pytestmark = pytest.mark.live

NOBODY = 65534


def test_viser_listens_on_no_port_and_leaves_nothing() -> None:
    before = tcp_listeners()
    private = PrivateViser("test")
    try:
        assert private.path.is_socket()
        assert private.path.parent.stat().st_mode & 0o777 == 0o700
        assert tcp_listeners() == before
    finally:
        private.close()
    assert not private.path.parent.exists()


@pytest.mark.skipif(os.getuid() != 0, reason="only root can become another user")
def test_another_user_of_the_machine_cannot_reach_viser() -> None:
    private = PrivateViser("test")
    program = "import os, socket, sys; {}socket.socket(socket.AF_UNIX).connect(sys.argv[1])"
    command = [sys.executable, "-I", "-c", program.format(""), str(private.path)]
    try:
        assert subprocess.run(command, check=False).returncode == 0, "its own user must reach it"
        # The interpreter itself may stand where nobody else reads: the child changes its user.
        command[3] = program.format(f"os.setgroups([]); os.setgid({NOBODY}); os.setuid({NOBODY}); ")
        refused = subprocess.run(command, capture_output=True, text=True, check=False)
        assert "PermissionError" in refused.stderr
    finally:
        private.close()


class WatchedQueue(deque):
    """Queue that notes in which threads somebody goes through it."""

    def __init__(self) -> None:
        super().__init__()
        self.threads: set[int] = set()

    def __iter__(self) -> Iterator[object]:
        self.threads.add(threading.get_ident())
        return super().__iter__()


def test_change_of_an_element_reaches_waiting_pages_through_the_event_loop_alone() -> None:
    private = PrivateViser("test")
    server = private.server
    element = server.gui.add_html("")
    buffer = server._websock_server.get_message_buffer()
    queue = WatchedQueue()
    pause = threading.Event()

    async def read(text: str) -> None:
        buffer.message_event._waiters = queue  # pyright: ignore[reportAttributeAccessIssue]
        pages = buffer.window_generator(0)
        async for window in pages:
            if text in str(window):
                await pages.aclose()
                return

    try:
        for text, together in (("one by one", False), ("together", True)):
            page = asyncio.run_coroutine_threadsafe(read(text), buffer.event_loop)
            while not queue and not page.done():
                pause.wait(0.001)
            if together:
                with server.atomic():
                    element.content = text
            else:
                element.content = text
            page.result(5.0)
    finally:
        private.close()
    assert queue.threads
    assert threading.get_ident() not in queue.threads
