from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from services.robot_gateway.drivers.cr5.replies import ReplyReader, integers
from shared.cr5.packet import PacketReader, blank

GOOD = [
    "0,{},EnableRobot(0.000000);",
    "0,{5},RobotMode();",
    "-1,{},User(3);",
    "0,{[[26,49],[],[],[],[],[],[]]},GetErrorID();",
    "0,{1,{0.0,0.0,-90.0,0.0,90.0,0.0}},GetStartPose(a.csv);",
    "0,{473.000000,-141.000000,469.000000,-180.000000,-0.000000,-90.000000},GetPose();",
    "Control Mode Is Not Tcp\t",
    "-2,{not tcp mode or system is starting},EnableRobot(1);",
]
LAST = "0,{7},SpeedFactor(42);"


def mutated(draw: st.DrawFn, text: bytes) -> bytes:
    """The text with bytes cut out, put in or changed."""
    data = bytearray(text)
    for _ in range(draw(st.integers(0, 4))):
        at = draw(st.integers(0, len(data)))
        data[at : at + draw(st.integers(0, 3))] = draw(st.binary(max_size=3))
    return bytes(data)


@st.composite
def streams(draw: st.DrawFn) -> list[bytes]:
    """Replies, some of them spoiled, cut anywhere."""
    whole = b"".join(
        mutated(draw, draw(st.sampled_from(GOOD)).encode()) for _ in range(draw(st.integers(1, 6)))
    )
    # A semicolon ends whatever was spoiled before the last one.
    whole += b";" + LAST.encode()
    cuts = sorted(draw(st.lists(st.integers(0, len(whole)), max_size=6)))
    return [whole[a:b] for a, b in zip([0, *cuts], [*cuts, len(whole)], strict=True)]


@settings(max_examples=300, deadline=None)
@given(streams())
def test_reader_gets_over_spoiled_replies_however_they_are_cut(parts: list[bytes]) -> None:
    reader = ReplyReader()
    replies = [reply for part in parts for reply in reader.feed(part)]
    assert replies[-1].echo == "SpeedFactor(42)"
    assert (replies[-1].error, replies[-1].values) == (0, "7")
    for reply in replies:
        assert reply.words
        integers(reply.values)


@pytest.mark.parametrize("digits", [10, 5000])
def test_number_without_end_is_no_error_code(digits: int) -> None:
    reader = ReplyReader()
    replies = reader.feed(b"9" * digits + b",{},RobotMode();" + LAST.encode())
    assert replies[-1].echo == "SpeedFactor(42)"
    assert all(abs(reply.error) < 10**9 for reply in replies)
    assert max(map(abs, integers("7" * digits))) < 10**9


@settings(max_examples=200, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_packets_are_found_among_spoiled_ones(seed: int) -> None:
    rng = np.random.default_rng(seed)
    good, reader, stream = blank(), PacketReader(), b""
    for _ in range(rng.integers(1, 5)):
        packet = bytearray(good.tobytes())
        for _ in range(rng.integers(0, 4)):
            # Most often where a packet says what it is.
            at = rng.integers(0, rng.choice([3, 60, 1440]))
            packet[at : at + rng.integers(0, 9)] = rng.bytes(rng.integers(0, 9))
        stream += bytes(packet)
    # Three whole ones: whatever was swallowed before, the newest of them is found.
    for k in range(3):
        good["time_stamp"] = 1000 + k
        stream += good.tobytes()
    found, at = [], 0
    while at < len(stream):
        size = int(rng.integers(1, 2000))
        packet = reader.feed(stream[at : at + size])
        at += size
        if packet is not None:
            found.append(int(packet["time_stamp"]))
    assert found[-1] == 1002
