from __future__ import annotations

import numpy as np
import pytest

from services.cr5_emulator.emulator import Emulator
from services.cr5_emulator.options import EmulatorOptions
from services.robot_gateway.drivers.cr5.client import Cr5Client
from services.robot_gateway.drivers.cr5.power_sequences import EnableSettings
from stack.simulation.emulated_arms import MemoryLink

TICK = 8_000_000


class Line:
    """A client at an emulated arm, and the text of everything that it asked there."""

    def __init__(self, settings: EnableSettings | None = None, **options: object) -> None:
        self.emulator = Emulator(EmulatorOptions(**{"power_on_time": 0.4, **options}))
        self.client = Cr5Client(MemoryLink(self.emulator), settings)
        self.now = 0
        self.asked: list[str] = []
        answer = self.emulator.commands.answer

        def noted(call, port):  # as the emulator's
            self.asked.append(call.text)
            return answer(call, port)

        self.emulator.commands.answer = noted

    def run(self, seconds: float) -> None:
        for _ in range(round(seconds / 0.008)):
            self.now += TICK
            self.client.step(self.now)


def test_arm_without_power_is_powered_enabled_and_set_in_this_order() -> None:
    line = Line(EnableSettings(1.25, (0.0, 0.01, 0.08), 4), powered=False)
    line.run(0.1)
    assert line.client.mode_words == "no power"
    line.client.enable()
    line.run(1.5)
    assert line.client.enabled, line.client.failure
    # Beside the heartbeat while it waits for power.
    assert [a for a in line.asked if a != "RobotMode()"] == [
        "ClearError()",
        "ResetRobot()",
        "PowerOn()",
        "EnableRobot(1.250000,0.000000,10.000000,80.000000)",
        "SpeedFactor(100)",
        "User(0)",
        "Tool(0)",
        "SetCollisionLevel(4)",
        "Continue()",
    ]
    assert line.emulator.controller.collision_level == 4


def test_v4_is_asked_for_control_and_to_release_its_emergency_stop_first() -> None:
    line = Line(firmware="v4")
    line.emulator.controller.press_emergency_stop()
    line.run(0.1)
    line.client.enable()
    line.run(1.5)
    assert line.client.enabled, line.client.failure
    asked = [a for a in line.asked if not a.startswith("GetErrorID")]
    assert asked[:4] == ["RequestControl()", "EmergencyStop(0)", "ClearError()", "Stop()"]


@pytest.mark.parametrize(
    ("release", "knows_times"), [("3.5.2", False), ("3.5.5", True), ("4.5", True), ("4.6", True)]
)
def test_every_release_that_is_supported_can_be_made_ready(release: str, knows_times: bool) -> None:
    line = Line(firmware="v3" if release < "4" else "v4", release=release)
    line.run(0.1)
    line.client.enable()
    line.run(1.0)
    assert line.client.enabled, line.client.failure
    packet = line.client.feedback
    assert packet is not None
    line.client.servo_joints(packet["q_actual"], 0.04)
    line.run(0.05)
    assert line.client.timed_joints == knows_times


def test_firmware_before_3_5_2_is_refused_in_words() -> None:
    line = Line(release="3.5.1")
    line.run(0.5)
    assert line.client.phase == "disconnected"
    assert "30004" in line.client.trouble
    assert "before 3.5.2" in line.client.trouble


def test_pauses_between_attempts_grow_until_the_arm_answers() -> None:
    line = Line(faults=("port_taken",))
    times: list[float] = []
    connect = line.emulator.connect

    def noted(port: int):  # as the emulator's
        if port == 29999:
            times.append(line.now * 1e-9)
        return connect(port)

    line.emulator.connect = noted
    line.run(20.0)
    np.testing.assert_allclose(np.diff(times)[:5], [0.5, 1.0, 2.0, 4.0, 8.0], atol=0.05)
    line.emulator.heal("port_taken")
    line.run(9.0)
    assert line.client.phase == "online"
    assert line.client.trouble == ""
    begun = line.now * 1e-9
    line.emulator.inject("links_closed")
    line.run(1.0)
    # Heard again, the first pause is short.
    assert times[-1] - begun == pytest.approx(0.5, abs=0.05)
    assert line.client.phase == "online"
    assert not line.client.enabled, "nothing is enabled by itself"


def test_feedback_alone_does_not_shorten_the_pauses() -> None:
    line = Line()
    knocks = 0
    for _ in range(200):
        line.run(0.1)
        for connection in line.emulator._connections:
            # As a controller does whose command port is somebody else's.
            if connection.port == 29999 and not connection.closed:
                knocks += 1
                connection.close()
    assert "does another program or a pendant hold it?" in line.client.trouble
    assert 5 <= knocks <= 7, "within 20 s"


def test_connection_that_is_lost_ends_what_was_under_way_and_says_why() -> None:
    line = Line(powered=False)
    line.run(0.1)
    line.client.enable()
    line.run(0.2)
    assert line.client.busy
    line.emulator.inject("links_closed")
    line.run(0.05)
    assert not line.client.busy
    assert "closed" in line.client.failure
    line.run(2.0)
    assert not line.client.enabled


def test_reply_to_another_request_does_not_advance_a_sequence() -> None:
    line = Line(faults=("no_user_tool",))
    line.run(0.1)
    line.client.request("RobotMode()")
    line.client.enable()
    line.run(1.0)
    assert line.asked[0] == "RobotMode()"
    assert line.client.failure == "User(0): failed"
    assert line.asked[-1] == "User(0)", "nothing is asked after what failed"
    assert not line.client.enabled


@pytest.mark.parametrize(("firmware", "stop"), [("v3", "ResetRobot()"), ("v4", "Stop()")])
def test_arm_that_its_guard_has_stopped_must_be_enabled_again(firmware: str, stop: str) -> None:
    line = Line(firmware=firmware)
    line.run(0.1)
    line.client.enable()
    line.run(1.0)
    assert line.client.enabled
    # Over the same connection, but not by this client.
    line.client._connection.streams[29999].send(stop.encode())
    line.run(0.1)
    assert not line.client.enabled
    assert "guard" in line.client.control_lost
    line.client.enable()
    line.run(1.0)
    assert line.client.enabled
    assert not line.client.control_lost


def test_shut_down_closes_every_port() -> None:
    line = Line()
    line.run(0.1)
    links = [c for c in line.emulator._connections if not c.closed]
    assert len(links) == 3
    line.client.shut_down()
    assert all(c.closed for c in links)


def test_second_client_is_refused_or_takes_the_place_of_the_first() -> None:
    for how, first_stays in (("refuse", True), ("replace", False)):
        line = Line(second_client=how)
        line.run(0.1)
        second = line.emulator.connect(29999)
        assert (second is None) == first_stays
        line.run(0.1)
        assert (line.client.phase == "online") == first_stays
        if not first_stays:
            assert "closed" in line.client.trouble


@pytest.mark.parametrize("vector", [np.full(6, np.nan), np.array([0, 0, np.inf, 0, 0, 0])])
def test_point_that_is_no_number_is_never_written(vector: np.ndarray) -> None:
    line = Line()
    line.run(0.1)
    with pytest.raises(ValueError, match="finite"):
        line.client.servo_pose(vector, 0.04)
