"""Universal Robots arm through `ur_rtde`. It has not been run on a robot.

The library's calls wait for the robot, so that they run in a thread of their own; `step` only
exchanges the newest target and the newest state with it. An arm that is sent no target for
`TARGET_AGE` is stopped by that thread.
"""

from __future__ import annotations

import logging
import threading
import time
from dataclasses import dataclass, replace
from importlib import import_module
from types import SimpleNamespace
from typing import Any

import numpy as np

from lariat.configuration import ConfigurationError
from lariat.protocols.arm import ArmFacts, ArmReading, ArmSetup, Joints

log = logging.getLogger(__name__)

PERIOD = 0.008
"""Time between two exchanges with the robot [s]."""
TARGET_AGE = 0.1
"""Age of the target above which the arm is stopped [s]."""
LOOKAHEAD_TIME = 0.05
"""Time over which servoJ smooths its path, 0.03 to 0.2 [s]."""
GAIN = 300.0
"""Gain of servoJ, 100 to 2000 [-]."""
RETRY_TIME = 2.0
"""Time between two attempts to connect [s]."""
STALE_TIME = 0.2
"""Age of the state above which the robot counts as silent [s]."""
POWER_TIMEOUT = 30.0
"""Longest time from the request for power to released brakes [s]."""
RUNNING_MODE = 7
"""Robot mode of released brakes."""
POWERED_MODES = (4, 5, 6, 7)
"""Robot modes in which the drives may have power: booting, idle, backdrive, running."""
SAFE_MODES = (1, 2)
"""Safety modes in which it may move: normal, reduced."""
SAFETY_MODES = {
    3: "protective stop",
    4: "recovery",
    5: "safeguard stop",
    6: "emergency stop of the system",
    7: "emergency stop of the robot",
    8: "violation",
    9: "fault",
}
"""Safety modes in which it must not move, in words."""

TO_ROOT = np.array([-1.0, -1.0, 1.0])
"""Half a turn about z, from the controller's base to the root of UR's URDF (REP 103)."""


def ur_rtde() -> Any:
    """Return the modules of the installed `ur_rtde`."""
    names = ("rtde_control", "rtde_receive", "dashboard_client", "rtde_io")
    try:
        return SimpleNamespace(**{name: import_module(name) for name in names})
    except ModuleNotFoundError as error:
        raise ConfigurationError(
            "driver = 'ur' needs ur_rtde; run in the clone: pip install -e '.[ur]'"
        ) from error


@dataclass(frozen=True)
class _Wish:
    """What the thread is to do."""

    target: Joints | None = None
    """Wanted joint angles [rad]."""
    at: float = 0.0
    """Monotonic time of that target [s]."""
    power: bool | None = None
    """Whether the drives should have power; None where nobody has asked."""
    closed: bool = True
    """Whether the gripper should be closed: tool output 0."""


class UrArm:
    """UR3, UR5, UR10 or UR16 with a gripper at tool output 0."""

    facts = ArmFacts(force_sensing=True)

    def __init__(self, setup: ArmSetup, library: Any = None) -> None:
        """Create the arm, by the installed library; its thread begins with the first step."""
        self._library = library or ur_rtde()
        self._host, self._joint_speed = setup.address, setup.joint_speed
        self._lock = threading.Lock()
        self._wish, self._reading = _Wish(), ArmReading(None, connected=False)
        self._read_at = 0.0
        self._ended = threading.Event()
        self._thread: threading.Thread | None = None

    def enable(self) -> None:
        self._change(power=True)

    def disable(self) -> None:
        self._change(power=False, target=None)

    def set_gripper(self, close: bool) -> None:
        self._change(closed=close)

    def close(self) -> None:
        self._ended.set()
        if self._thread:
            self._thread.join(timeout=1.0)

    def step(self, time: float, target: Joints | None) -> ArmReading:
        if self._thread is None:
            self._thread = threading.Thread(target=self._run, name="ur_rtde", daemon=True)
            self._thread.start()
        self._change(target=None if target is None else np.array(target), at=_now())
        with self._lock:
            # Power that was asked for comes later than the next reading.
            reading = replace(
                self._reading, powered=self._reading.powered or bool(self._wish.power)
            )
            if reading.connected and _now() - self._read_at > STALE_TIME:
                return replace(reading, connected=False, ready=False)
            return reading

    def _change(self, **changes: Any) -> None:
        with self._lock:
            self._wish = replace(self._wish, **changes)

    def _publish(self, reading: ArmReading) -> None:
        with self._lock:
            self._reading, self._read_at = reading, _now()

    def _run(self) -> None:
        """Connect, and exchange until the connection is lost; over and over."""
        while not self._ended.is_set():
            try:
                self._exchange()
            except Exception as error:
                # The library raises RuntimeError and others for whatever the line does.
                log.warning("UR at %s: %s", self._host, error)
                self._publish(ArmReading(None, connected=False, faults=(str(error),)))
            self._ended.wait(RETRY_TIME)

    def _exchange(self) -> None:
        library, host = self._library, self._host
        board = library.dashboard_client.DashboardClient(host)
        board.connect()
        receive = library.rtde_receive.RTDEReceiveInterface(host)
        session = _Session(board, receive, library, host, self._joint_speed)
        try:
            while not self._ended.is_set() and receive.isConnected():
                began = _now()
                with self._lock:
                    wish = self._wish
                session.follow(wish)
                self._publish(session.reading(wish))
                self._ended.wait(max(0.0, PERIOD - (_now() - began)))
            if not self._ended.is_set():
                raise ConnectionError("the robot has closed the connection")
        finally:
            session.end()


class _Session:
    """One connection to the robot's controller."""

    def __init__(
        self, board: Any, receive: Any, library: Any, host: str, joint_speed: float
    ) -> None:
        self._board, self._receive, self._library = board, receive, library
        self._host, self._joint_speed = host, joint_speed
        self._control: Any = None
        self._power_asked: float | None = None
        self._moving = False
        self._closed: bool | None = None

    def follow(self, wish: _Wish) -> None:
        """Bring power, gripper and arm nearer to what is wanted."""
        mode = self._receive.getRobotMode()
        if wish.power is False:
            self._stop()
            if mode in POWERED_MODES or self._power_asked is not None:
                self._board.powerOff()
            self._power_asked = None
            return
        if wish.power is None:
            return
        if mode != RUNNING_MODE:
            if self._power_asked is None:
                self._power_asked = _now()
                self._board.powerOn()
                self._board.brakeRelease()
            return
        if self._control is None:
            self._control = self._library.rtde_control.RTDEControlInterface(self._host)
        if wish.closed != self._closed:
            self._library.rtde_io.RTDEIOInterface(self._host).setToolDigitalOut(0, wish.closed)
            self._closed = wish.closed
        safe = self._receive.getSafetyMode() in SAFE_MODES
        if wish.target is None or _now() - wish.at > TARGET_AGE or not safe:
            self._stop()
            return
        self._moving = True
        self._control.servoJ(
            wish.target.tolist(), self._joint_speed, 0.0, PERIOD, LOOKAHEAD_TIME, GAIN
        )

    def reading(self, wish: _Wish) -> ArmReading:
        """State of the robot."""
        receive = self._receive
        mode, safety = receive.getRobotMode(), receive.getSafetyMode()
        faults = [SAFETY_MODES[safety]] if safety in SAFETY_MODES else []
        late = self._power_asked is not None and _now() - self._power_asked > POWER_TIMEOUT
        if late and mode != RUNNING_MODE:
            faults.append(f"no released brakes within {POWER_TIMEOUT:g} s")
        following = self._control is not None and self._control.isConnected()
        return ArmReading(
            joints=np.array(receive.getActualQ()),
            velocities=np.array(receive.getActualQd()),
            ready=bool(wish.power and mode == RUNNING_MODE and following and not faults),
            powered=mode in POWERED_MODES,
            faults=tuple(faults),
            gripper_closed=wish.closed,
            force=TO_ROOT * receive.getActualTCPForce()[:3],
            mode=f"robot mode {mode}",
        )

    def end(self) -> None:
        """Stop the arm and close the connections."""
        self._stop()
        if self._control is not None:
            self._control.stopScript()
            self._control.disconnect()
        self._receive.disconnect()
        self._board.disconnect()

    def _stop(self) -> None:
        """End the servo motion, if there is one."""
        if self._moving and self._control is not None:
            self._control.servoStop()
        self._moving = False


def _now() -> float:
    return time.monotonic()
