"""viser on a socket that only this user reaches, whose elements any thread may change.

viser listens on a TCP port, which every user of the machine may open. Here it listens on a Unix
socket in a folder of mode 0700; the web server is in front of it.
"""

from __future__ import annotations

import asyncio
import dataclasses
import io
import threading
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout
from pathlib import Path
from typing import Any

import viser
import websockets.asyncio.server as websocket_server
from viser.infra import _infra
from viser.infra._async_message_buffer import AsyncMessageBuffer

from lariat.files.temporary_folder import TemporaryFolder

_patch = threading.Lock()


class LoopEvent(asyncio.Event):
    """Event that only a running event loop sets.

    viser 1.1 sets the event of a message buffer twice for each message: in the thread that changes
    an element, and then in its loop. The first goes through the queue of the pages that wait while
    the loop changes that queue, which now and then raises `RuntimeError`.
    """

    def set(self) -> None:
        """Wake all who wait, in an event loop; do nothing in another thread."""
        try:
            asyncio.get_running_loop()
        except RuntimeError:
            return
        super().set()


@dataclasses.dataclass
class MessageBuffer(AsyncMessageBuffer):
    """Buffer of viser to which any thread may push."""

    message_event: asyncio.Event = dataclasses.field(default_factory=LoopEvent)


class PrivateViser:
    """A viser server, and the Unix socket on which it listens."""

    def __init__(self, title: str) -> None:
        # Also the buffers of pages that connect later.
        _infra.AsyncMessageBuffer = MessageBuffer  # pyright: ignore[reportPrivateImportUsage]
        self._folder = TemporaryFolder("lariat-page-")
        self.path = self._folder.path / "viser"
        """The socket."""
        # viser prints a banner even when not verbose; standard output is reserved for answers.
        with redirect_stdout(io.StringIO()), _unix_sockets(self.path):
            self.server = viser.ViserServer(host="127.0.0.1", port=0, label=title, verbose=False)
        if not self.path.is_socket():
            self.close()
            raise RuntimeError(f"viser {viser.__version__} does not listen on {self.path}")

    def close(self) -> None:
        """Stop the server and its threads."""
        with redirect_stdout(io.StringIO()):
            self.server.stop()
        self._folder.remove()


@contextmanager
def _unix_sockets(path: Path) -> Iterator[None]:
    """Let the WebSocket server that is started meanwhile listen on a Unix socket.

    viser has no option for it. It looks the function up in this module when it starts.
    """
    original = websocket_server.serve

    def serve(handler: Any, host: str, port: int, **options: Any) -> Any:
        return original(handler, unix=True, path=str(path), **options)

    with _patch:
        websocket_server.serve = serve
        try:
            yield
        finally:
            websocket_server.serve = original
