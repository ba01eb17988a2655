from __future__ import annotations

import struct

import numpy as np
import pytest

from services.cr5_emulator import frames
from shared.cr5.packet import PacketReader
from tests.services.cr5_emulator.bench import Bench


def segments(bench: Bench, ticks: int) -> list[bytes]:
    rows = []
    for _ in range(ticks):
        bench.now += 0.008
        bench.emulator.advance_to(bench.now)
        while (segment := bench.feedback.take()) is not None:
            rows.append(segment)
    return rows


@pytest.mark.parametrize("firmware", ["v3", "v4"])
def test_packet_is_1440_bytes_with_every_field_at_its_offset(firmware: str) -> None:
    bench = Bench(firmware)
    bench.enable()
    bench.ask("DOExecute(1,1)" if firmware == "v3" else "DOInstant(1,1)")
    bench.ask("SpeedFactor(42)")
    (data,) = segments(bench, 1)
    assert len(data) == 1440
    assert struct.unpack_from("<q", data, 0) == (1440,), "V3 clients read the size as eight bytes"
    assert data[48:56] == bytes.fromhex("EFCDAB8967452301")
    assert struct.unpack_from("<Q", data, 16) == (1,)
    assert struct.unpack_from("<Q", data, 24) == (5,)
    assert struct.unpack_from("<Q", data, 32) == (8,)
    assert struct.unpack_from("<d", data, 64) == (42.0,)
    np.testing.assert_allclose(struct.unpack_from("<6d", data, 432), [0, 0, -90, 0, 90, 0])
    np.testing.assert_allclose(struct.unpack_from("<3d", data, 624), [473, -141, 469], atol=1e-9)
    np.testing.assert_allclose(np.abs(struct.unpack_from("<d", data, 648)), 180.0)
    quaternion = np.array(struct.unpack_from("<4d", data, 1384))
    assert abs(quaternion @ [0.0, np.sqrt(0.5), -np.sqrt(0.5), 0.0]) > 1.0 - 1e-12
    assert data[1014] == 1
    assert data[1016:1024] == bytes(
        [50, 50, 0, 50, 50, 50, 50, 0] if firmware == "v3" else [100, 100, 0, 100, 100, 100, 100, 0]
    )
    assert data[1026] == 1
    assert data[1031] == 5


def test_speed_of_the_flange_is_the_derivative_of_its_pose() -> None:
    bench = Bench()
    bench.enable()
    bench.ask("MovL(473,-41,420,180,20,-90)", motion=True)
    packets = bench.run(0.4)
    before, middle, after = packets[-3:]
    difference = (after["tool_vector_actual"] - before["tool_vector_actual"])[:3] / 0.016
    np.testing.assert_allclose(middle["tcp_speed_actual"][:3], difference, rtol=0.1, atol=1.0)
    turn = (
        frames.transform(after["tool_vector_actual"])
        @ np.linalg.inv(frames.transform(before["tool_vector_actual"]))
    )[:3, :3]
    rate = np.degrees([turn[2, 1], turn[0, 2], turn[1, 0]]) / 0.016
    np.testing.assert_allclose(middle["tcp_speed_actual"][3:], rate, rtol=0.1, atol=0.5)


def test_slow_ports_send_every_200_and_50_milliseconds() -> None:
    bench = Bench()
    slow, middling = bench.connect(30005), bench.connect(30006)
    bench.run(2.0)
    counts = []
    for connection in (slow, middling):
        count = 0
        while connection.take() is not None:
            count += 1
        counts.append(count)
    assert counts == [10, 40]


def test_reader_finds_packets_that_are_torn_joined_or_follow_rubbish() -> None:
    whole = b"".join(segments(Bench(), 60))
    stream = b"\x00\xa0\x05rubbish" * 31 + whole[:1440] + b"\xef\xcd\xab" + whole[1440:]
    rng = np.random.default_rng(2)
    reader, found, at = PacketReader(), [], 0
    while at < len(stream):
        size = int(rng.integers(1, 900))
        packet = reader.feed(stream[at : at + size])
        at += size
        if packet is not None:
            found.append(int(packet["time_stamp"]))
    assert found == sorted(found)
    assert len(found) >= 58
    assert found[-1] == 480


def test_reader_keeps_the_newest_of_a_backlog() -> None:
    packet = PacketReader().feed(b"".join(segments(Bench(), 20)))
    assert packet is not None
    assert int(packet["time_stamp"]) == 160


def test_reader_survives_a_million_random_bytes() -> None:
    reader = PacketReader()
    rng = np.random.default_rng(1)
    for _ in range(20):
        assert reader.feed(rng.bytes(50_000)) is None
    (data,) = segments(Bench(), 1)
    assert reader.feed(data + data) is not None
