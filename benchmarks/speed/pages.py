"""Browsers that keep a page open and read all that it sends."""

from __future__ import annotations

import asyncio
import threading
from contextlib import suppress
from urllib.parse import urlsplit

import aiohttp
import msgspec
import viser

from dashboard.web.browser_messages import ViewerCameraMessage

PROTOCOL = f"viser-v{viser.__version__}"
"""Protocol of viser's side of the page."""
CAMERA = ViewerCameraMessage(
    wxyz=(1.0, 0.0, 0.0, 0.0),
    position=(0.0, -1.0, 0.5),
    fov=0.8,
    near=0.01,
    far=1000.0,
    image_height=800,
    image_width=1280,
    look_at=(0.0, 0.0, 0.0),
    up_direction=(0.0, 0.0, 1.0),
)
"""First message of a browser: a page counts as open, and is sent everything, from then on."""
OPEN_TIMEOUT = 30.0
"""Longest wait for all pages to be open [s]."""


class OpenPages:
    """Pages that are open until they are closed, in a thread of their own."""

    def __init__(self, address: str, count: int, pause: float = 0.0) -> None:
        """Open pages, each of which pauses after every message [s].

        Raises:
            RuntimeError: The pages cannot be opened in time.
        """
        self._address, self._count, self._pause = address, count, pause
        self.received = 0
        """Amount that all pages have received [bytes]."""
        self.closed = 0
        """Number of pages whose connection has ended."""
        self.reason = ""
        """Error that ended the last of them; empty where the dashboard closed it."""
        self._open = 0
        self._all_open = threading.Event()
        self._loop = asyncio.new_event_loop()
        self._reading: asyncio.Task[None] | None = None
        self._thread = threading.Thread(target=self._run, name="pages", daemon=True)
        self._thread.start()
        if not self._all_open.wait(OPEN_TIMEOUT):
            raise RuntimeError(f"only {self._open} of {count} pages could be opened")

    def close(self) -> None:
        """Close all pages."""
        if self._reading is not None:
            # The loop has ended where no page is open any more.
            with suppress(RuntimeError):
                self._loop.call_soon_threadsafe(self._reading.cancel)
        self._thread.join()

    def _run(self) -> None:
        async def read() -> None:
            self._reading = asyncio.current_task()
            await self._read_all()

        try:
            self._loop.run_until_complete(read())
        except asyncio.CancelledError:
            pass
        finally:
            self._loop.close()

    async def _read_all(self) -> None:
        async with aiohttp.ClientSession() as session:
            page, headers = await admitted(session, self._address)
            await asyncio.gather(*(self._keep(session, page, headers) for _ in range(self._count)))

    async def _keep(
        self, session: aiohttp.ClientSession, page: str, headers: dict[str, str]
    ) -> None:
        """Keep one page open; one that ends leaves the others."""
        try:
            await self._read(session, page, headers)
        except (aiohttp.ClientError, OSError) as error:
            self.reason = repr(error)
        self.closed += 1

    async def _read(
        self, session: aiohttp.ClientSession, page: str, headers: dict[str, str]
    ) -> None:
        async with session.ws_connect(
            page, protocols=(PROTOCOL,), headers=headers, max_msg_size=0
        ) as browser:
            await browser.send_bytes(msgspec.msgpack.encode(CAMERA))
            self._open += 1
            if self._open == self._count:
                self._all_open.set()
            async for message in browser:
                self.received += len(message.data or b"")
                if self._pause:
                    await asyncio.sleep(self._pause)


async def admitted(session: aiohttp.ClientSession, address: str) -> tuple[str, dict[str, str]]:
    """Open the address that the dashboard printed; return that of its page, and its headers."""
    origin = f"http://{urlsplit(address).netloc}"
    async with session.get(address) as answer:
        entrance = await answer.text()
        cookie = answer.headers["Set-Cookie"].partition(";")[0]
    page = origin + entrance.partition("url=")[2].partition('"')[0].rstrip("/")
    return page, {"Cookie": cookie, "Origin": origin}
