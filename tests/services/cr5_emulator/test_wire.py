from __future__ import annotations

import re

import pytest

from services.cr5_emulator.emulator import Emulator
from services.cr5_emulator.options import EmulatorOptions
from tests.services.cr5_emulator import wire_v3, wire_v4
from tests.services.cr5_emulator.bench import Bench

NUMBER = r"-?\d+(?:\.\d+)?"


def fits(reply: str, call: str, expected: int | str) -> bool:
    """Whether a reply is error, values and echo, as they are to be."""
    reply = reply.replace("-0.000000", "0.000000") if isinstance(expected, str) else reply
    if isinstance(expected, int) and expected < 0:
        return reply == f"{expected},{{}},{call};"
    if expected == wire_v4.ID:
        values = r"\d+"
    elif isinstance(expected, int):
        values = ",".join([NUMBER] * expected)
    else:
        values = re.escape(expected)
    return re.fullmatch(rf"0,\{{{values}\}},{re.escape(call)};", reply) is not None


def converse(bench: Bench, calls: list[tuple[str, int | str]], motion: bool = False) -> None:
    """Asks one thing after the other, each when the arm has done the one before."""
    for call, expected in calls:
        reply = bench.ask(call, motion)
        assert fits(reply, call, expected), f"{call} is answered {reply}, not {expected}"
        connection = bench.motion if motion else bench.commands
        assert not connection.closed
        settle(bench)


def settle(bench: Bench) -> None:
    controller = bench.emulator.controller
    for _ in range(1000):
        bench.run(0.008)
        if controller.jogging or controller.paused or not controller.busy:
            return
    raise AssertionError("the arm does not come to rest")


def test_every_call_of_the_v3_client_is_answered_as_documented() -> None:
    bench = Bench("v3")
    converse(bench, wire_v3.DASHBOARD)


def test_every_motion_of_the_v3_client_is_answered_as_documented() -> None:
    bench = Bench("v3")
    bench.enable()
    converse(bench, wire_v3.MOTION, motion=True)
    assert bench.emulator.controller.alarms == []


def test_every_call_of_the_v4_client_is_answered_as_documented() -> None:
    bench = Bench("v4")
    converse(bench, wire_v4.SETTINGS)
    assert bench.emulator.controller.alarms == []


def test_every_motion_of_the_v4_client_is_answered_as_documented() -> None:
    bench = Bench("v4")
    bench.enable()
    converse(bench, wire_v4.MOTION)


@pytest.mark.parametrize("calls", [wire_v3.DASHBOARD, wire_v4.SETTINGS])
def test_answers_fit_the_one_read_that_clients_do(calls: list[tuple[str, int | str]]) -> None:
    bench = Bench("v3" if calls is wire_v3.DASHBOARD else "v4")
    for call, _ in calls:
        bench.commands.feed(call.encode())
        bench.emulator.process()
        segment = bench.commands.take()
        assert segment is not None, call
        assert len(segment) <= 1024
        assert bench.commands.take() is None, f"{call} is answered in two segments"


@pytest.mark.parametrize(
    ("release", "call", "reply"),
    [
        ("3.5.2", "ServoJ(0,0,-90,0,90,0,t=0.1)", "-20000,{}"),
        ("3.5.2", "ServoJ(0,0,-90,0,90,181)", "-40006,{}"),
        ("3.5.5", "ServoJ(0,0,-90,0,90,181,t=3)", "0,{}"),
        ("3.5.5", "RelJointMovJ(0,0,0,0,0,1)", "0,{}"),
        ("4.5", "ServoJ(0,0,-90,0,90,0,t=0.01)", "-60001,{}"),
        ("4.5", "RequestControl()", "-10000,{}"),
        ("4.5", "GetErrorID()", "0,{[[],[],[],[],[],[],[]]}"),
        ("4.6", "ServoJ(0,0,-90,0,90,0,t=0.01)", "0,{1}"),
    ],
)
def test_release_knows_what_its_documents_say(release: str, call: str, reply: str) -> None:
    firmware = "v3" if release.startswith("3") else "v4"
    bench = Bench(firmware, release=release)
    bench.emulator.controller.enable()
    answer = bench.ask(call, motion=True)
    assert answer.startswith(reply), answer


def test_pause_is_not_known_before_3_5_7() -> None:
    assert Bench(release="3.5.5").ask("Pause()") == "-10000,{},Pause();"


def test_oldest_release_sends_its_packets_where_it_takes_motion() -> None:
    emulator = Emulator(EmulatorOptions(release="3.5.1"))
    assert emulator.ports == (29999, 30003)
    motion = emulator.connect(30003)
    assert motion is not None
    emulator.controller.enable()
    motion.feed(b"RelJointMovJ(0,0,0,0,0,1)MovJ(1)")
    emulator.process()
    assert motion.take() == b"RelJointMovJ(0,0,0,0,0,1)"
    assert motion.take() == b"could not understand: 'MovJ(1)'"
    emulator.advance_to(0.008)
    packet = motion.take()
    assert packet is not None
    assert len(packet) == 1440
