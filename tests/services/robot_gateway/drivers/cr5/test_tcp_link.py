"""The thin shell round a device's socket."""

from __future__ import annotations

import contextlib
import socket
import time
from collections.abc import Callable, Iterator

import pytest

from lariat.configuration import ConfigurationError
from services.robot_gateway.drivers.cr5.link import ByteStream
from services.robot_gateway.drivers.cr5.tcp_link import TcpLink

pytestmark = pytest.mark.live


@pytest.fixture
def server() -> Iterator[socket.socket]:
    with socket.create_server(("127.0.0.1", 0)) as listening:
        listening.settimeout(5.0)
        yield listening


def connect(server: socket.socket) -> tuple[TcpLink, ByteStream, socket.socket]:
    link = TcpLink("127.0.0.1")
    # The step's clock need not agree with this one, only run alike.
    link.advance(time.monotonic_ns() + 12_345_678_901)
    stream = link.open(server.getsockname()[1])
    peer, _ = server.accept()
    peer.settimeout(2.0)
    assert stream.state == "open"
    return link, stream, peer


def until(condition: Callable[[], object]) -> None:
    deadline = time.monotonic() + 5.0
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.002)


def test_unknown_host_is_a_configuration_error() -> None:
    for host in ("192.168.5.1:29999", "no such arm"):
        with pytest.raises(ConfigurationError, match="write its IP address"):
            TcpLink(host)


def test_commands_of_a_step_that_was_suspended_are_not_sent(server) -> None:
    link, stream, peer = connect(server)
    link.advance(time.monotonic_ns() + 12_345_678_901)
    time.sleep(0.01)
    stream.send(b"in time;")
    # Stopped for a while in the middle of the step.
    time.sleep(0.1)
    stream.send(b"too late;")
    link.advance(time.monotonic_ns() + 12_345_678_901)
    stream.send(b"again in time;")
    assert peer.recv(100) == b"in time;again in time;"


def test_aborted_link_resets_and_a_closed_one_ends_in_order(server) -> None:
    _, stream, peer = connect(server)
    stream.send(b"last words")
    stream.close()
    assert peer.recv(100) == b"last words"
    assert peer.recv(100) == b""
    _, stream, peer = connect(server)
    stream.abort()
    assert stream.state == "closed"
    with pytest.raises(ConnectionResetError):
        peer.recv(100)


def test_bytes_go_both_ways_and_nothing_waits(server: socket.socket) -> None:
    _, stream, peer = connect(server)
    with peer:
        assert stream.receive() == b""
        stream.send(b"RobotMode()")
        assert peer.recv(100) == b"RobotMode()"
        peer.sendall(b"0,{5},")
        peer.sendall(b"RobotMode();")
        parts = bytearray()

        def whole() -> bool:
            parts.extend(stream.receive())
            return parts == b"0,{5},RobotMode();"

        until(whole)
        stream.close()


def test_port_without_a_listener_is_closed_with_a_reason() -> None:
    with socket.create_server(("127.0.0.1", 0)) as listening:
        port = listening.getsockname()[1]
    stream = TcpLink("127.0.0.1").open(port)
    until(lambda: stream.state == "closed")
    assert stream.reason == f"127.0.0.1:{port}: connection refused"
    stream.send(b"x")
    assert stream.receive() == b""


@pytest.mark.parametrize("how", ["shut", "reset"])
def test_other_side_that_goes_is_noticed(server: socket.socket, how: str) -> None:
    _, stream, peer = connect(server)
    if how == "reset":
        # Closing with bytes that were never read resets the connection.
        stream.send(b"unread")
        until(lambda: len(peer.recv(6, socket.MSG_PEEK)) == 6)
    peer.close()

    def gone() -> bool:
        stream.receive()
        return stream.state == "closed"

    until(gone)
    assert "closed by the other side" in stream.reason or "reset" in stream.reason


def test_close_is_orderly_and_may_be_done_twice(server: socket.socket) -> None:
    _, stream, peer = connect(server)
    with peer:
        stream.send(b"DisableRobot()")
        stream.close()
        stream.close()
        assert stream.state == "closed"
        data = bytearray()
        with contextlib.suppress(ConnectionError):
            while part := peer.recv(100):
                data += part
        assert data == b"DisableRobot()", "what was written before arrives"


def test_peer_that_takes_no_bytes_does_not_fill_the_memory(server: socket.socket) -> None:
    _, stream, peer = connect(server)
    with peer:
        for _ in range(2000):
            stream.send(b"x" * 65536)
            if stream.state == "closed":
                break
        assert stream.reason.endswith("the device reads no more bytes")
