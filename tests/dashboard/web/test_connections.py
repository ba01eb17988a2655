"""Connections of those who show no cookie, with real sockets: bounded in time and number."""

from __future__ import annotations

import json
import logging
import resource
import socket
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager

import pytest

from dashboard.options import DashboardOptions
from dashboard.web import connections
from dashboard.web.site import Site
from shared.runtime.free_port import free_port
from tests.dashboard.web.test_web_server import Arms
from tests.dashboard.web.visitor import Visitor
from tests.shared.cell import until

pytestmark = pytest.mark.live

HALF_SENT = (
    "POST /login HTTP/1.1\r\nHost: {name}\r\nOrigin: http://{name}\r\nContent-Length: 4000\r\n"
    "Content-Type: application/x-www-form-urlencoded\r\n\r\npassword="
)


@pytest.fixture(scope="module")
def site() -> Iterator[Site]:
    site = Site(DashboardOptions(port=free_port()), "test", Arms())
    site.open_viser()
    try:
        yield site
    finally:
        site.close()


def connect(site: Site, sent: bytes = b"") -> socket.socket:
    """Connection of somebody of whom the page knows nothing."""
    port = int(site.address.partition("/?")[0].rpartition(":")[2])
    client = socket.create_connection(("127.0.0.1", port), 10.0)
    client.sendall(sent)
    return client


def is_closed(client: socket.socket, within: float) -> bool:
    """Whether the page ends a connection in a time [s]."""
    client.settimeout(within)
    try:
        return not client.recv(1)
    except ConnectionResetError:
        return True
    except TimeoutError:
        return False


@contextmanager
def crowd(site: Site, count: int) -> Iterator[list[socket.socket]]:
    """So many connections, of which nothing comes; some are closed by the page meanwhile."""
    with ExitStack() as stack:
        yield [stack.enter_context(connect(site)) for _ in range(count)]


@pytest.mark.parametrize("sent", ["", "GET / HT", HALF_SENT], ids=["nothing", "header", "body"])
def test_half_sent_request_ends(site: Site, sent: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(connections, "STRANGER_TIME", 0.5)
    name = Visitor(site.address).netloc
    with connect(site, sent.replace("{name}", name).encode()) as client:
        assert not is_closed(client, 0.3)
        assert is_closed(client, 5.0)


def test_connection_of_an_admitted_browser_stays(
    site: Site, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(connections, "STRANGER_TIME", 0.2)
    person = Visitor(site.address).enter()
    with person.open_socket("/cell") as open_socket, crowd(site, 2 * connections.MAX_STRANGERS):
        time.sleep(0.5)
        open_socket.send('{"type": "hold", "number": 3}')
        answer = json.loads(open_socket.recv(5.0))
    assert answer == {"hold": 3, "answer": {"confirmed": True, "text": "Holding still"}}


def test_oldest_stranger_of_the_address_that_has_the_most_goes_first(site: Site) -> None:
    with (
        socket.socket() as other,
        crowd(site, connections.MAX_STRANGERS - 1) as strangers,
    ):
        other.bind(("127.0.0.2", 0))
        other.connect(strangers[0].getpeername())
        assert not is_closed(strangers[0], 0.2)
        with connect(site):
            assert is_closed(strangers[0], 5.0)
        assert not is_closed(strangers[-1], 0.1)
        assert not is_closed(other, 0.1)


def test_thousands_of_connections_leave_an_open_page_its_hold(
    site: Site, caplog: pytest.LogCaptureFixture
) -> None:
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    assert soft == hard, "the page raises its limit"
    person = Visitor(site.address).enter()
    with (
        caplog.at_level(logging.WARNING),
        person.open_socket("/cell") as open_socket,
        ExitStack() as stack,
    ):
        for number in range(5000):
            stack.enter_context(connect(site))
            if number % 50 == 0:
                open_socket.send(json.dumps({"type": "hold", "number": number}))
                assert json.loads(open_socket.recv(5.0))["answer"]["confirmed"]
        # Who comes now, with the printed address, gets in as well.
        assert Visitor(site.address).enter().page
    assert len(caplog.records) < 10


def test_what_is_no_request_is_logged_a_few_times_only(
    site: Site, caplog: pytest.LogCaptureFixture
) -> None:
    with caplog.at_level(logging.WARNING):
        for _ in range(200):
            with connect(site, b"GET / HTTP/1.1\r\nHost: a\r\nX: \x00\r\n\r\n") as client:
                until(lambda client=client: client.recv(4096) or True)
    assert 1 <= len(caplog.records) <= 4
