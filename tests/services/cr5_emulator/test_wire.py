from __future__ import annotations

import re

import numpy as np
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


def test_outputs_switch_where_the_path_says() -> None:
    bench = Bench("v4", joints=(0.0, 0.0, -90.0, 0.0, 90.0, 0.0))
    bench.enable()
    bench.ask("MovLIO(pose={473,-141,369,180,0,-90},{0,30,2,1},{1,-20,3,1},v=20)")
    heights = {}
    for _ in range(400):
        (packet,) = bench.run(0.008)
        for port in (2, 3):
            if int(packet["digital_outputs"]) >> (port - 1) & 1:
                heights.setdefault(port, packet["tool_vector_target"][2])
    # 30 % of 100 mm behind the start, and 20 mm before the end; 8 ms at 400 mm/s are 3.2 mm.
    assert heights[2] == pytest.approx(439.0, abs=3.5)
    assert heights[3] == pytest.approx(389.0, abs=3.5)


def test_a_pulse_ends_by_itself() -> None:
    bench = Bench("v4")
    bench.ask("DO(1,1,100)")
    states = [int(p["digital_outputs"]) for p in bench.run(0.2)]
    assert sum(states) == pytest.approx(100 / 8, abs=1)
    assert states[-1] == 0


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
        ("4.5", "FCOff()", "-10000,{}"),
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


def test_script_keeps_others_from_moving_the_arm_and_ends() -> None:
    bench = Bench("v4", script_time=0.2)
    bench.enable()
    bench.ask("RunScript(demo)")
    assert bench.ask("MovJ(joint={0,0,-90,0,90,10})").startswith("-5,")
    assert int(bench.run(0.1)[-1]["robot_mode"]) == 7
    bench.ask("Pause()")
    assert int(bench.run(0.3)[-1]["robot_mode"]) == 10
    assert bench.ask("MovJ(joint={0,0,-90,0,90,10})").startswith("-7,")
    bench.ask("Continue()")
    assert int(bench.run(0.2)[-1]["robot_mode"]) == 5
    assert bench.ask("MovJ(joint={0,0,-90,0,90,10})").startswith("0,")


def test_arm_that_was_moved_in_a_pause_goes_back_to_where_it_was() -> None:
    bench = Bench("v4")
    bench.enable()
    bench.ask("MovJ(joint={20,0,-90,0,90,0},v=20)")
    bench.run(0.3)
    bench.ask("Pause()")
    held = bench.run(0.2)[-1]["q_actual"].copy()
    bench.ask("MoveJog(J6+)")
    assert int(bench.run(0.3)[-1]["robot_mode"]) == 8
    bench.ask("MoveJog()")
    away = bench.run(0.5)[-1]
    assert int(away["robot_mode"]) == 10
    assert away["q_actual"][5] > held[5] + 5.0
    assert bench.ask("PathRecoveryStatus()") == "0,{2},PathRecoveryStatus();"
    bench.ask("PathRecovery()")
    bench.run(2.0)
    assert bench.ask("PathRecoveryStatus()") == "0,{0},PathRecoveryStatus();"
    bench.ask("Continue()")
    np.testing.assert_allclose(bench.run(3.0)[-1]["q_actual"], [20, 0, -90, 0, 90, 0], atol=0.01)


def test_joint_that_is_taken_past_its_set_limit_raises_its_alarm() -> None:
    bench = Bench("v3")
    limits = "-10,10,-178,178,-160,160,-178,178,-178,178,-357,357"
    assert bench.ask(f"SetAxisLimit({limits})") == f"0,{{}},SetAxisLimit({limits});"
    bench.enable()
    bench.ask("JointMovJ(20,0,-90,0,90,0)", motion=True)
    bench.run(2.0)
    assert bench.emulator.controller.alarms == [64]
    assert abs(np.degrees(bench.emulator.controller.joints[0]) - 10.0) < 6.0
