"""The thin shell round a device's socket."""

from __future__ import annotations

import socket
import time
from collections.abc import Iterator

import pytest

from services.robot_gateway.link import Link, TcpNetwork


@pytest.fixture
def server() -> Iterator[socket.socket]:
    with socket.create_server(("127.0.0.1", 0)) as listening:
        listening.settimeout(5.0)
        yield listening


def connect(server: socket.socket) -> tuple[TcpNetwork, Link, socket.socket]:
    network = TcpNetwork("127.0.0.1")
    # The step's clock need not agree with this one, only run alike.
    network.advance(time.monotonic_ns() + 12_345_678_901)
    link = network.open(server.getsockname()[1])
    peer, _ = server.accept()
    peer.settimeout(2.0)
    assert link.state == "open"
    return network, link, peer


def test_process_that_was_stopped_within_a_step_does_not_say_what_it_meant_before(server) -> None:
    network, link, peer = connect(server)
    network.advance(time.monotonic_ns() + 12_345_678_901)
    time.sleep(0.01)
    link.send(b"in time;")
    # Stopped for a while in the middle of the step.
    time.sleep(0.1)
    link.send(b"too late;")
    network.advance(time.monotonic_ns() + 12_345_678_901)
    link.send(b"again in time;")
    assert peer.recv(100) == b"in time;again in time;"


def test_aborted_link_resets_and_a_closed_one_says_farewell(server) -> None:
    _, link, peer = connect(server)
    link.send(b"last words")
    link.close()
    assert peer.recv(100) == b"last words"
    assert peer.recv(100) == b""
    _, link, peer = connect(server)
    link.abort()
    assert link.state == "closed"
    with pytest.raises(ConnectionResetError):
        peer.recv(100)
