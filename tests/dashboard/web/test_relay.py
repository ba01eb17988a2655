"""Hostile pages of the real dashboard: admitted browsers that send what no page sends."""

from __future__ import annotations

import threading
from collections.abc import Iterable, Iterator
from contextlib import suppress
from itertools import repeat
from random import Random

import msgspec
import pytest
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection

from dashboard.options import DashboardOptions
from dashboard.service import DashboardService, build
from dashboard.web import browser_messages, relay
from lariat.scenario import load
from shared.messages import ArmCommand
from shared.runtime.free_port import free_port
from tests.dashboard.stage import Stage
from tests.dashboard.web.visitor import Visitor
from tests.shared.cell import until

pytestmark = pytest.mark.live

SCENARIO = load("scenarios/three-cylinders.toml")
encode = msgspec.msgpack.encode


@pytest.fixture(scope="module")
def service() -> Iterator[DashboardService]:
    service = build(SCENARIO, "dashboard-ab", DashboardOptions(port=free_port()))
    service.warm_up()
    try:
        yield service
    finally:
        service.close()


@pytest.fixture
def person(service: DashboardService) -> Visitor:
    return Visitor(service.address).enter()


def hostile_messages(names: list[str], count: int) -> Iterator[bytes | str]:
    """Yield random bytes, valid messages with bytes changed, and values of wrong types."""
    random = Random(20260101)
    values = [None, True, -1, 1e308, 10**18, "x", "–", "box", [], [1.0], [0.0] * 3, ["a"] * 3, {}]
    for _ in range(count):
        update = {
            "type": "GuiUpdateMessage",
            "uuid": random.choice(names),
            "updates": {random.choice(("value", "value", "visible")): random.choice(values)},
        }
        drag = {
            "type": random.choice(("TransformControlsUpdateMessage", "SceneNodeClickMessage")),
            "name": random.choice(("/edit/left", "/edit/obstacle", "/obstacles/low", "/")),
            "wxyz": [random.choice((0.0, 1.0, 1e9)) for _ in range(4)],
            "position": [random.choice((0.0, -1e9, 1e9)) for _ in range(3)],
        }
        raw = bytearray(encode(random.choice((update, drag))))
        kind = random.random()
        if kind < 0.2:
            yield random.randbytes(random.randrange(200))
        elif kind < 0.3:
            yield "text"
        elif kind < 0.6:
            raw[random.randrange(len(raw))] = random.randrange(256)
            yield bytes(raw)
        else:
            yield bytes(raw)


def test_hostile_messages_end_neither_the_process_nor_other_pages(
    service: DashboardService, person: Visitor
) -> None:
    stage = Stage(service, SCENARIO)
    stage.play(0.3)
    stage.step()
    names = list(service._page._server.gui._gui_input_handle_from_uuid)
    with person.open_socket() as other:
        other.recv(10.0)
        with person.open_socket() as hostile:
            hostile.recv(10.0)
            for message in hostile_messages(names, relay.MAX_RATE - 100):
                hostile.send(message)
            hostile.ping().wait(20.0)
            stage.play(0.3)
            stage.step()
        # Whatever the hostile page pressed, the service goes on and the other page gets news.
        for k in range(3):
            stage.play(0.4 + 0.1 * k)
            stage.step()
        assert other.recv(10.0)


def close_code(socket: ClientConnection, messages: Iterable[bytes]) -> int:
    """Send messages until the web server closes the connection; its code."""
    with suppress(ConnectionClosed):
        for message in messages:
            socket.send(message)
        while True:
            socket.recv(10.0)
    assert socket.close_code is not None
    return socket.close_code


def test_frame_beyond_the_bound_ends_its_own_connection(person: Visitor) -> None:
    with person.open_socket() as other, person.open_socket() as hostile:
        assert close_code(hostile, [bytes(browser_messages.MAX_MESSAGE + 1)]) == 1009
        assert other.recv(10.0)


def test_flood_ends_its_own_connection(person: Visitor) -> None:
    with person.open_socket() as hostile:
        assert close_code(hostile, repeat(b"\x00", 20 * relay.MAX_RATE)) == 1008


def test_uploads_of_one_page_are_bounded(person: Visitor) -> None:
    part = {
        "type": "FileTransferPart",
        "source_component_uuid": "a",
        "transfer_uuid": "b",
        "part_index": 0,
        "content": bytes(browser_messages.MAX_PART),
    }
    with person.open_socket() as hostile:
        assert close_code(hostile, repeat(encode(part), 100)) == 1009


def test_hold_is_sent_while_viser_is_stuck(service: DashboardService, person: Visitor) -> None:
    stage = Stage(service, SCENARIO)
    freed = threading.Event()
    service._page._server._event_loop.call_soon_threadsafe(freed.wait)
    asker = threading.Thread(target=person.ask, args=("POST", person.page + "hold"))
    asker.start()
    try:
        actions: list[int] = []
        until(lambda: actions.extend(m.action for _, m in stage.step()) or actions)
        assert actions == [ArmCommand.HOLD]
    finally:
        freed.set()
        asker.join()


def test_pages_are_counted_and_bounded(person: Visitor, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(relay, "MAX_PAGES", 2)
    upgrade = {"Connection": "Upgrade", "Upgrade": "websocket"}
    path, origin = person.page.rstrip("/"), f"http://{person.netloc}"
    with person.open_socket(), person.open_socket():
        assert person.ask("GET", path, Origin=origin, **upgrade).status == 503
        assert person.ask("GET", person.page).status == 200
        other = person.ask("GET", f"{path}x/")
        assert other.status == 503
        assert "Close one" in other.text
