from __future__ import annotations

import asyncio
import json
import socket
from collections.abc import Iterator
from concurrent.futures import Future
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import ClientConnection

from dashboard.options import DashboardOptions
from dashboard.web import cell_socket, relay, web_server
from dashboard.web.cell_socket import Approach, HoldAnswer
from dashboard.web.site import Site
from lariat.configuration import ConfigurationError
from shared.runtime.free_port import free_port
from tests.dashboard.web.listeners import tcp_listeners
from tests.dashboard.web.visitor import Visitor
from tests.shared.cell import until

pytestmark = pytest.mark.live

PASSWORD = "correct horse battery"
LAB = {"Host": "lab.example", "Origin": "https://lab.example"}


class Arms:
    """Cell that confirms every hold, unless it is deaf."""

    def __init__(self) -> None:
        self.held = 0
        self.deaf = False
        self.signs: list[int] = []
        self.released: list[int] = []

    def hold(self) -> Future[HoldAnswer]:
        self.held += 1
        answer: Future[HoldAnswer] = Future()
        if not self.deaf:
            answer.set_result(HoldAnswer(True, "Holding still"))
        return answer

    def approach(self, sign: Approach) -> None:
        self.signs.append(sign.press)

    def release(self, press: int) -> None:
        self.released.append(press)


@pytest.fixture(scope="module")
def arms() -> Arms:
    return Arms()


@pytest.fixture(scope="module")
def site(arms: Arms, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Site]:
    file = tmp_path_factory.mktemp("secrets") / "password"
    file.touch(0o600)
    file.write_text(PASSWORD + "\n")
    port = free_port()
    options = DashboardOptions(
        port=port,
        address=(f"http://127.0.0.1:{port}", "https://lab.example"),
        password_file=file,
    )
    site = Site(options, "test", arms)
    site.open_viser()
    try:
        yield site
    finally:
        site.close()


SEEN = '{"type": "seen"}'
"""Receipt of a status."""


def news(site: Site, socket: ClientConnection) -> dict:
    """What a page hears next."""
    site.show_status('{"text": "Armed"}')
    message = json.loads(socket.recv(5.0))
    while True:
        socket.send(SEEN)
        try:
            message = json.loads(socket.recv(0.05))
        except TimeoutError:
            return message


def take_controls(site: Site, socket: ClientConnection) -> dict:
    """What a page hears once it has the controls, which a page before it may just have left."""
    while (heard := news(site, socket))["controls"]["role"] != "holder":
        socket.send('{"type": "ask"}')
    return heard


@pytest.fixture
def stranger(site: Site) -> Visitor:
    """Somebody who has not entered."""
    return Visitor(site.address)


@pytest.fixture
def person(site: Site) -> Visitor:
    """Somebody who has opened the printed address."""
    return Visitor(site.address).enter()


def test_printed_address_leads_to_the_page_and_its_stop_bar(person: Visitor) -> None:
    page = person.ask("GET", person.page)
    assert page.status == 200
    assert "stop_bar.js" in page.text
    assert '<div id="root">' in page.text
    assert person.ask("GET", person.page + "stop_bar.js").status == 200


def test_only_the_door_listens(site: Site) -> None:
    assert int(site.address.partition("/?")[0].rpartition(":")[2]) in tcp_listeners()


@pytest.mark.parametrize("query", ["", "?token=", "?token=wrong", "?token=%00%ff"])
def test_without_the_token_nobody_enters(stranger: Visitor, query: str) -> None:
    answer = stranger.ask("GET", "/" + query)
    assert answer.status == 403
    assert "Set-Cookie" not in answer.headers
    assert "?token=" in answer.text


def test_neither_path_nor_cookie_alone_opens_the_page(person: Visitor) -> None:
    assert person.ask("GET", person.page, Cookie="").status == 403
    assert person.ask("GET", person.page, Cookie="lariat=0").status == 403
    assert person.ask("GET", "/somewhere/").status == 403
    assert person.ask("POST", person.page + "hold", Cookie="").status == 403
    cookie, person.cookie = person.cookie, ""
    for path in ("", "/cell"):
        with pytest.raises(InvalidStatus, match="403"):
            person.open_socket(path)
    assert cookie


def test_cookie_is_kept_from_scripts_other_sites_and_other_ports(stranger: Visitor) -> None:
    answer = stranger.ask("GET", f"/?{stranger.query}")
    words = answer.headers["Set-Cookie"].split("; ")
    assert {"HttpOnly", "SameSite=Strict"} <= set(words)
    path = next(w.partition("=")[2] for w in words if w.startswith("Path="))
    assert len(path) > 32, "browsers send cookies to every port of a host, so the path is secret"


@pytest.mark.parametrize("host", ["evil.example", "127.0.0.1.evil.example:8080", "10.0.0.1", ""])
def test_foreign_host_is_refused_even_with_the_token(person: Visitor, host: str) -> None:
    for path in (f"/?{person.query}", person.page):
        assert person.ask("GET", path, Host=host or " ").status in (400, 421)
    assert person.ask("POST", person.page + "hold", Host=host or " ").status in (400, 421)


@pytest.mark.parametrize("path", ["", "/cell"])
@pytest.mark.parametrize("origin", ["https://evil.example", "http://127.0.0.1:9", "null"])
def test_socket_of_another_site_is_refused(person: Visitor, path: str, origin: str) -> None:
    with pytest.raises(InvalidStatus, match="403"):
        person.open_socket(path, origin)


@pytest.mark.parametrize("origin", ["https://evil.example", "http://127.0.0.1:9", "null", ""])
def test_hold_of_another_site_is_refused(person: Visitor, arms: Arms, origin: str) -> None:
    held = arms.held
    assert person.ask("POST", person.page + "hold", Origin=origin).status == 403
    assert arms.held == held


def test_every_answer_forbids_frames_other_servers_and_referrers(person: Visitor) -> None:
    for path in ("/", person.page, person.page + "nothing"):
        headers = person.ask("GET", path).headers
        policy = headers["Content-Security-Policy"]
        assert "frame-ancestors 'none'" in policy
        assert "connect-src 'self'" in policy
        assert headers["Referrer-Policy"] == "no-referrer"


@pytest.mark.parametrize(
    ("place", "bound"), [("", (relay, "MAX_PAGES")), ("/cell", (cell_socket, "MAX_BARS"))]
)
def test_pages_are_bounded(
    person: Visitor, monkeypatch: pytest.MonkeyPatch, place: str, bound: tuple[Any, str]
) -> None:
    monkeypatch.setattr(*bound, 0)
    with pytest.raises(InvalidStatus, match="503"):
        person.open_socket(place)


def test_holds_that_wait_are_bounded(person: Visitor, arms: Arms) -> None:
    before, arms.deaf = arms.held, True
    try:
        with person.open_socket("/cell") as socket:
            for number in range(3 * cell_socket.MAX_HOLDS):
                socket.send(json.dumps({"type": "hold", "number": number}))
            socket.send("no message, which ends the connection")
            while True:
                socket.recv(timeout=10.0)
    except ConnectionClosed:
        pass
    finally:
        arms.deaf = False
    assert arms.held - before == cell_socket.MAX_HOLDS


def test_hold_is_answered_with_what_the_gateway_says(person: Visitor, arms: Arms) -> None:
    answer = person.ask("POST", person.page + "hold")
    assert json.loads(answer.text) == {"confirmed": True, "text": "Holding still"}
    arms.deaf = True
    answer = person.ask("POST", person.page + "hold")
    arms.deaf = False
    assert not json.loads(answer.text)["confirmed"]


def test_press_ends_with_its_connection_and_with_what_is_no_message(
    person: Visitor, arms: Arms, site: Site
) -> None:
    site.show_status('{"text": "Armed"}')
    sign = '{"type": "approach", "press": %d, "distance": 0.1, "angle": 0.0}'
    with person.open_socket("/cell") as socket:
        assert take_controls(site, socket)["cell"] == {"text": "Armed"}
        socket.send(sign % 7)
        until(lambda: 7 in arms.signs)
    until(lambda: 7 in arms.released)
    with person.open_socket("/cell") as socket:
        take_controls(site, socket)
        socket.send(sign % 8)
        socket.send('{"type": "approach"}')
        until(lambda: 8 in arms.released)


def test_slow_browser_gets_the_newest_status_and_none_of_those_before(
    person: Visitor, site: Site
) -> None:
    site.show_status('{"text": "0"}')
    with person.open_socket("/cell") as socket:
        take_controls(site, socket)
        site.show_status('{"text": "1"}')
        assert json.loads(socket.recv(5.0))["cell"] == {"text": "1"}
        # It is busy while these come.
        for number in range(2, 50):
            site.show_status(f'{{"text": "{number}"}}')
        with pytest.raises(TimeoutError):
            socket.recv(0.3)
        socket.send(SEEN)
        assert json.loads(socket.recv(5.0))["cell"] == {"text": "49"}


def test_no_task_is_left_pending_at_the_end(arms: Arms) -> None:
    port = free_port()
    site = Site(DashboardOptions(port=port, address=(f"http://127.0.0.1:{port}",)), "test", arms)
    waiting = asyncio.run_coroutine_threadsafe(asyncio.sleep(60.0), site._web_server._loop)
    site.close()
    assert waiting.cancelled()


def test_page_without_the_controls_asks_for_them_and_approaches_nothing(
    site: Site, arms: Arms
) -> None:
    pages = [Visitor(site.address).enter() for _ in range(2)]
    with pages[0].open_socket("/cell") as first, pages[1].open_socket("/cell") as second:
        take_controls(site, first)
        assert news(site, second)["controls"]["role"] == "watcher"
        second.send('{"type": "approach", "press": 9, "distance": 0.1, "angle": 0.0}')
        second.send('{"type": "answer", "give": true}')
        second.send('{"type": "ask"}')
        until(lambda: news(site, first)["controls"]["asked"])
        assert 9 not in arms.signs
        first.send('{"type": "answer", "give": true}')
        until(lambda: news(site, second)["controls"]["role"] == "holder")
        assert news(site, first)["controls"]["role"] == "watcher"
        assert pages[0].ask("POST", pages[0].page + "hold").status == 200, "everybody may hold"


def test_beyond_this_machine_the_password_admits_and_the_token_does_not(stranger: Visitor) -> None:
    assert "type=password" in stranger.ask("GET", f"/?{stranger.query}", **LAB).text
    refused = stranger.ask("POST", "/login", "password=the+wrong+one", **LAB)
    assert refused.status == 403
    assert "Set-Cookie" not in refused.headers
    assert stranger.ask("POST", "/login", f"password={PASSWORD}").status == 403
    admitted = stranger.ask("POST", "/login", f"password={PASSWORD.replace(' ', '+')}", **LAB)
    assert "Secure" in admitted.headers["Set-Cookie"]
    stranger.enter(admitted)
    assert stranger.ask("GET", stranger.page, Host="lab.example").status == 200
    assert stranger.ask("GET", stranger.page).status == 403, "the cookie is for the other address"


@pytest.mark.parametrize(
    "kind",
    ["multipart/form-data; boundary=x", "application/x-www-form-urlencoded; charset=nonsense"],
)
def test_form_that_is_none_is_refused(stranger: Visitor, kind: str) -> None:
    body = '--x\r\nContent-Disposition: form-data; name="a"\r\n\r\nq'
    answer = stranger.ask("POST", "/login", body, **LAB, **{"Content-Type": kind})
    assert answer.status == 400


def test_forms_that_are_sent_late_are_bounded_too(
    site: Site, stranger: Visitor, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(web_server, "WRONG_PASSWORD_DELAY", 0.1)
    port = int(stranger.netloc.rpartition(":")[2])
    form = b"password=wrong"
    head = "".join(f"{name}: {value}\r\n" for name, value in LAB.items())
    head += "Content-Type: application/x-www-form-urlencoded\r\n"
    request = f"POST /login HTTP/1.1\r\n{head}Content-Length: {len(form)}\r\n\r\n".encode()
    with ExitStack() as stack:
        several = range(web_server.MAX_LOGINS + 4)
        sockets = [
            stack.enter_context(socket.create_connection(("127.0.0.1", port))) for _ in several
        ]
        for each in sockets:
            each.sendall(request)
        # Until the server has read every request, and waits for its form.
        assert stranger.ask("POST", "/login", "password=wrong", **LAB).status == 403
        for each in sockets:
            each.sendall(form)
        statuses = [each.recv(4096).split()[1] for each in sockets]
    assert statuses.count(b"429") in range(1, 5)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"address": ("http://lab.example",)}, "TLS"),
        ({"address": ("https://lab.example",)}, "--password-file"),
        ({"address": ("lab",)}, "http://NAME:PORT"),
    ],
)
def test_address_that_admits_too_many_is_refused(options: dict, words: str) -> None:
    with pytest.raises(ConfigurationError, match=words):
        Site(DashboardOptions(port=free_port(), **options), "test")


def test_token_file_is_private_and_used_again(tmp_path: Path) -> None:
    file = tmp_path / "token"
    options = DashboardOptions(port=free_port(), token_file=file)
    addresses = []
    for _ in range(2):
        site = Site(options, "test")
        addresses.append(site.address)
        site.close()
    assert file.stat().st_mode & 0o777 == 0o600
    assert addresses[0] == addresses[1]
    assert addresses[0].endswith(file.read_text().strip())
    file.chmod(0o644)
    with pytest.raises(ConfigurationError, match="readable by every user"):
        Site(options, "test")
