from __future__ import annotations

import json

import pytest

from tests.services.cr5_emulator.bench import Bench, read

pytestmark = pytest.mark.live

GET = "GET /protocol/getAlarm HTTP/1.1\r\nHost: arm\r\nAccept: */*\r\n\r\n"


def post(body: str) -> str:
    head = "POST /interface/language HTTP/1.1\r\nContent-Type: application/json\r\n"
    return f"{head}content-length: {len(body)}\r\n\r\n{body}"


def exchange(bench: Bench, *pieces: str) -> tuple[int, dict]:
    """Status and content of one answer, which must state its length."""
    page = bench.connect(22000)
    for piece in pieces:
        page.feed(piece.encode())
        bench.emulator.process()
    head, _, body = read(page).partition("\r\n\r\n")
    page.close()
    assert f"Content-Length: {len(body)}" in head
    return int(head.split()[1]), json.loads(body)


def test_alarms_are_told_over_http_as_the_v4_client_reads_them() -> None:
    bench = Bench("v4")
    assert exchange(bench, post('{"type": "en"}'))[0] == 200
    assert exchange(bench, GET) == (200, {"errMsg": []})
    bench.run(1.0)
    bench.ask("EmergencyStop(1)")
    bench.run(1.0)
    status, content = exchange(bench, GET[:30], GET[30:])
    assert status == 200
    (alarm,) = content["errMsg"]
    assert alarm["id"] == 116
    assert "emergency stop" in alarm["description"]
    # The clock of this arm began at 1970.
    assert (alarm["date"], alarm["time"]) == ("1970-01-01", "00:00:01")
    assert {"level", "solution", "mode"} <= alarm.keys()
    bench.ask("EmergencyStop(0)ClearError()")
    assert exchange(bench, GET) == (200, {"errMsg": []})


def test_what_is_no_request_is_refused_and_the_next_one_answered() -> None:
    bench = Bench("v4")
    assert exchange(bench, post('{"type": "latin"}'))[0] == 400
    assert exchange(bench, post("[1"))[0] == 400
    assert exchange(bench, "GET /nowhere HTTP/1.1\r\n\r\n")[0] == 404
    assert exchange(bench, "DELETE /protocol/getAlarm HTTP/1.1\r\n\r\n")[0] == 405
    page = bench.connect(22000)
    page.feed(b"\x00" * 200_000)
    bench.emulator.process()
    assert read(page).startswith("HTTP/1.1 400")
    page.feed(GET.encode())
    bench.emulator.process()
    assert read(page).startswith("HTTP/1.1 200")


def test_v3_has_no_such_port() -> None:
    assert 22000 not in Bench("v3").emulator.ports
