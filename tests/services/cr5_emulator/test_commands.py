from __future__ import annotations

import re

import numpy as np
import pytest

from shared.cr5.pose_vectors import vector_of
from tests.services.cr5_emulator.bench import Bench, read

POSE = "473.000000,-141.000000,469.000000,180.000000,0.000000,-90.000000"


@pytest.mark.parametrize(
    ("firmware", "call", "code"),
    [
        ("v3", "NoSuchThing()", -10000),
        ("v3", "ServoP(1,2,3,4,5,6)", -10000),  # motion belongs on 30003
        ("v3", "MovS(1)", -10000),
        ("v3", "EnableRobot(1,2)", -20000),
        ("v3", "EnableRobot(a)", -30001),
        ("v3", "EnableRobot(5.5)", -40001),
        ("v3", "EnableRobot(1,0,x,0)", -30003),
        ("v3", "SpeedFactor(0)", -40001),
        ("v3", "SpeedFactor(nan)", -30001),
        ("v3", "DO(17,1)", -40001),
        ("v3", "DO(1,2)", -40002),
        ("v3", "DO(1)", -20000),
        ("v3", "DO(1_0,1)", -30001),
        ("v3", "User(5)", -1),
        ("v3", "GetPose(User=0)", -20000),
        # What the vendor's own client gets wrong on the wire.
        ("v3", "InverseSolution(1,2,3,4,5,6,0,01,'{1,2,3,4,5,6}')", -30009),
        ("v3", "PayLoad(10.02)", -20000),
        ("v4", "MovJ(1,2,3,4,5,6)", -20000),
        ("v4", "MovJ(pose={1,2,3})", -30001),
        ("v4", "MovJ(pose={1,2,3,4,5,x})", -30001),
        ("v4", "MovJ(v=20)", -20000),
        ("v4", "MovJ(pose={473,-141,469,180,0,-90},v=101)", -60001),
        ("v4", "MovJ(pose={473,-141,469,180,0,-90},v=fast)", -50001),
        ("v4", "ServoJ(0,0,-90,0,90,0,t=0.001)", -60001),
        ("v4", "ServoJ(0,0,-90,0,90)", -20000),
        ("v4", "EmergencyStop()", -20000),
        ("v4", "SetPayload()", -20000),
        ("v4", "MoveJog(Q9+)", -1),
        ("v4", "PowerOn(1)", -20000),
    ],
)
def test_malformed_command_is_answered_with_its_code_and_the_link_stays(
    firmware: str, call: str, code: int
) -> None:
    bench = Bench(firmware)
    assert bench.ask(call) == f"{code},{{}},{call};"
    assert not bench.commands.closed
    assert bench.ask("RobotMode()") == "0,{4},RobotMode();"


def test_commands_are_framed_by_their_parenthesis_however_they_are_cut() -> None:
    bench = Bench()
    assert bench.ask("Robot") == ""
    assert bench.ask("Mode") == ""
    assert bench.ask("()robotmode()\r\n GetErrorID") == "0,{4},RobotMode();0,{4},robotmode();"
    assert bench.ask("()") == "0,{[[],[],[],[],[],[],[]]},GetErrorID();"


@pytest.mark.parametrize("firmware", ["v3", "v4"])
def test_kinematics_on_the_wire_are_the_published_ones(firmware: str) -> None:
    bench = Bench(firmware)
    forward = {
        "v3": "PositiveSolution(0,0,-90,0,90,0,0,0)",
        "v4": "PositiveKin(0,0,-90,0,90,0)",
    }[firmware]
    back = {
        "v3": "InverseSolution(473,-141,469,180,0,-90,0,0)",
        "v4": "InverseKin(473,-141,469,180,0,-90,useJointNear=1,JointNear={0,0,-90,0,90,0})",
    }[firmware]
    found = numbers(bench.ask(forward))
    np.testing.assert_allclose(found[:3], [473, -141, 469], atol=1e-5)
    np.testing.assert_allclose(numbers(bench.ask(back)), [0, 0, -90, 0, 90, 0], atol=1e-4)


def numbers(reply: str) -> list[float]:
    match = re.match(r"0,\{([^}]*)\}", reply)
    assert match is not None, reply
    return [float(v) for v in match.group(1).split(",")]


@pytest.mark.parametrize("firmware", ["v3", "v4"])
def test_queued_moves_are_accepted_at_once_and_carried_out_in_order(firmware: str) -> None:
    bench = Bench(firmware)
    bench.enable()
    if bench.v4:
        first = bench.ask("MovJ(pose={473,-141,420,180,0,-90},v=50)")
        second = bench.ask("MovL(pose={473,-101,420,180,0,-90},speed=100)")
        assert (first[:4], second[:4]) == ("0,{1", "0,{2")
    else:
        assert bench.ask(f"MovJ({POSE})", motion=True) == f"0,{{}},MovJ({POSE});"
        bench.ask("MovJ(473,-141,420,180,0,-90,SpeedJ=50)", motion=True)
        bench.ask("MovL(473,-101,420,180,0,-90)", motion=True)
        assert bench.ask("Sync()", motion=True) == ""
    modes = [int(p["robot_mode"]) for p in bench.run(2.0)]
    assert 7 in modes
    assert modes[-1] == 5
    end = bench.run(0.1)[-1]
    np.testing.assert_allclose(end["tool_vector_actual"][:3], [473, -101, 420], atol=0.01)
    if bench.v4:
        assert bench.ask("GetCurrentCommandID()") == "0,{2},GetCurrentCommandID();"
    else:
        assert read(bench.motion) == "0,{},Sync();"


@pytest.mark.parametrize(
    ("firmware", "call", "alarm"),
    [
        ("v3", "MovL(473,-141,1200,180,0,-90)", 17),
        ("v3", "JointMovJ(0,0,-170,0,90,0)", 69),
        ("v3", "ServoJ(90,0,-90,0,90,0,t=0.05)", 48),
        ("v4", "MovL(pose={473,-141,1200,180,0,-90})", 17),
    ],
)
def test_impossible_motion_raises_the_alarm_of_its_kind(
    firmware: str, call: str, alarm: int
) -> None:
    bench = Bench(firmware, power_on_time=0.3)
    bench.enable()
    bench.ask(call, motion=True)
    assert int(bench.run(0.5)[-1]["robot_mode"]) == 9
    assert str(alarm) in bench.ask("GetErrorID()")
    answer = bench.ask("MovL(pose={473,-141,469,180,0,-90})" if bench.v4 else f"MovJ({POSE})", True)
    assert answer.startswith("-2," if bench.v4 else "-1,")
    bench.ask("ClearError()")
    if firmware == "v3" and alarm == 48:
        # The drives tripped, and the arm lost its power.
        assert bench.ask("EnableRobot()").startswith("-1")
        bench.ask("PowerOn()")
        bench.run(0.4)
    bench.enable()
    assert int(bench.run(0.1)[-1]["robot_mode"]) == 5


def test_sync_is_answered_when_what_it_waited_for_was_dropped() -> None:
    bench = Bench()
    bench.enable()
    for _ in range(2):
        bench.ask("RelJointMovJ(10,0,0,0,0,0)", motion=True)
    assert bench.ask("Sync()", motion=True) == ""
    bench.run(0.1)
    bench.ask("ResetRobot()")
    bench.run(0.4)
    assert read(bench.motion) == "0,{},Sync();"


def test_queue_of_v3_stays_shut_behind_an_alarm_until_continue() -> None:
    bench = Bench()
    bench.enable()
    bench.ask("MovL(473,-141,1200,180,0,-90)", motion=True)
    bench.run(0.1)
    bench.ask("ClearError()")
    assert bench.ask("RelJointMovJ(1,0,0,0,0,0)", motion=True).startswith("0,")
    shut = bench.run(0.5)[-1]
    assert (int(shut["enable_status"]), int(shut["queue_running"])) == (1, 0)
    assert abs(shut["q_actual"][0]) < 1e-6
    bench.ask("Continue()")
    np.testing.assert_allclose(bench.run(1.0)[-1]["q_actual"][0], 1.0, atol=1e-3)


def test_line_through_the_wrist_singularity_is_refused_with_alarm_26() -> None:
    bench = Bench(joints=(0.0, 0.0, -90.0, 0.0, 30.0, 0.0))
    bench.enable()
    across = numbers(bench.ask("PositiveSolution(0,0,-90,0,-30,0,0,0)"))
    bench.ask(f"MovL({','.join(map(str, across))})", motion=True)
    assert int(bench.run(0.1)[-1]["robot_mode"]) == 9
    assert bench.ask("GetErrorID()") == "0,{[[26],[],[],[],[],[],[]]},GetErrorID();"


def test_emergency_stop_differs_between_versions() -> None:
    v3 = Bench("v3", power_on_time=0.3)
    v3.enable()
    v3.ask("EmergencyStop()")
    v3.ask("PowerOn()")
    v3.run(0.4)
    v3.enable()
    v4 = Bench("v4")
    v4.enable()
    v4.ask("EmergencyStop(1)")
    assert v4.ask("EnableRobot()").startswith("-3,")
    assert int(v4.run(0.05)[-1]["safety_state"]) & 1 == 0, "active low"
    v4.ask("EmergencyStop(0)")
    assert v4.ask("EnableRobot()").startswith("-2,")
    v4.ask("ClearError()")
    v4.enable()


def test_numbers_of_modes_mean_what_the_firmware_says() -> None:
    for firmware, jogging in (("v3", 11), ("v4", 8)):
        bench = Bench(firmware)
        bench.enable()
        bench.ask("MoveJog(J1+)", motion=True)
        packet = bench.run(0.2)[-1]
        assert int(packet["robot_mode"]) == jogging
        assert packet["q_actual"][0] > 0.0
        bench.ask("MoveJog()", motion=True)
        assert int(bench.run(0.4)[-1]["robot_mode"]) == 5
    bench.emulator.inject("collision")
    bench.ask("MoveJog(J1+)")
    assert int(bench.run(0.1)[-1]["robot_mode"]) == 11


def test_outputs_switch_on_both_versions() -> None:
    for firmware, now in (("v3", "DOExecute"), ("v4", "DOInstant")):
        bench = Bench(firmware)
        bench.ask(f"{now}(3,1)")
        assert int(bench.run(0.016)[-1]["digital_outputs"]) == 0b100
        bench.ask(f"Tool{now}(1,1)")
        assert bench.emulator.controller.tool_outputs == [1, 0]


def test_queue_is_finite() -> None:
    bench = Bench(queue_depth=4)
    bench.enable()
    bench.run(0.1)
    answers = [bench.ask(f"MovJ({POSE})", motion=True)[:2] for _ in range(6)]
    assert answers == ["0,"] * 4 + ["-1"] * 2


@pytest.mark.parametrize("firmware", ["v3", "v4"])
def test_a_million_random_bytes_on_every_port_change_nothing(firmware: str) -> None:
    bench = Bench(firmware)
    rng = np.random.default_rng(11)
    for port in bench.emulator.ports:
        connection = {29999: bench.commands, 30003: bench.motion}.get(port) or bench.connect(port)
        for _ in range(20):
            connection.feed(rng.bytes(50_000))
            bench.run(0.008)
        assert not connection.closed
    read(bench.commands)
    # Rubbish without an end may swallow the first command behind it.
    bench.ask(")")
    assert bench.ask("RobotMode()").endswith("0,{4},RobotMode();")


def test_placing_at_the_start_restores_the_joints_of_the_start() -> None:
    start = (139.9, 136.3, -121.8, -14.5, -49.9, -180.0)
    bench = Bench("v4", joints=start)
    arm = bench.emulator.controller
    pose = arm.geometry.flange(np.radians(start))
    vector = ",".join(f"{v:.6f}" for v in vector_of(pose[:3, 3], pose[:3, :3]))
    # Where the first arm of scenarios/two-arms.toml stands after a run.
    arm.target = arm.joints = np.radians([180.1, 42.6, 118.4, -161.0, -90.1, -180.0])
    assert bench.ask(f"EmulatorPlace({vector})").startswith("0,")
    np.testing.assert_allclose(np.degrees(arm.joints), start, atol=1e-3)
