"""Controller of the emulated arm: power, modes, alarms, motion queue and drives."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from services.cr5_emulator.kinematics import (
    CALIBRATED_GEOMETRY,
    NOMINAL_GEOMETRY,
    Joints,
    Transform,
)
from services.cr5_emulator.motions import Alarm, Braking, JogMotion, Motion, check_range
from services.cr5_emulator.options import EmulatorOptions
from services.cr5_emulator.servo_follower import ServoFollower

StartAction = Callable[[Joints], Motion | None]
"""Action of a queue entry, given the present joint angles; returns a motion if it takes time."""

EMERGENCY_STOP_ALARM, COLLISION_ALARM = 116, 117
"""Alarm numbers."""
OVERSPEED_ALARMS = range(48, 54)
"""Alarm numbers, one for each joint."""


@dataclass
class QueueEntry:
    """One entry of the queue."""

    number: int
    start: StartAction


class Controller:
    """State of the emulated arm, advanced in time."""

    def __init__(self, options: EmulatorOptions) -> None:
        self.options = options
        self.v4 = options.firmware == "v4"
        self.geometry = CALIBRATED_GEOMETRY if options.calibrated else NOMINAL_GEOMETRY
        self.target: Joints = np.radians(options.joints)
        """Commanded joint angles, which the drives follow [rad]."""
        self.target_speed = np.zeros(6)
        self.target_acceleration = np.zeros(6)
        self.joints = self.target.copy()
        """Actual joint angles [rad]."""
        self.joint_speed = np.zeros(6)
        self.time = 0.0
        """Time since the start [s]."""
        self.powered = options.powered
        self.power_on_remaining = 0.0
        """Time until power is on [s]."""
        self.enabled = False
        self.dragging = 0
        """Hand guiding: 0 off, 1 on."""
        self.pressed = False
        """Whether the emergency stop is pressed."""
        self.not_tcp = False
        """Whether the control mode is no longer TCP."""
        self.uncalibrated = False
        """Whether User and Tool fail."""
        self.alarms: list[int] = []
        self.paused = False
        self.queue_running = True
        self.queue: deque[QueueEntry] = deque()
        self.current: tuple[int, Motion] | None = None
        self.unqueued: Motion | None = None
        """Motion outside the queue, as a jog; it also runs during a pause."""
        self.number = 0
        """Number of the entry queued last."""
        self.finished = 0
        """Number of the entry begun last."""
        self._servo = ServoFollower(options)
        self._braking: Braking | None = None
        self.speed_factor = 100
        self.outputs = 0
        self.inputs = 0
        self.tool_outputs = [0, 0]
        self.load = 0.0
        self.load_center = np.zeros(3)
        self.ratios = dict.fromkeys(("accj", "accl", "speedj", "speedl"), 100 if self.v4 else 50)
        self.collision_level = 3
        """0 (off) to 5 (most sensitive); stored without effect."""

    # Commands and events

    @property
    def mode(self) -> int:
        """RobotMode; 8 and 11 differ between V3 and V4."""
        if self.alarms:
            return 11 if self.v4 and COLLISION_ALARM in self.alarms else 9
        if self.power_on_remaining > 0.0:
            return 1
        if not self.powered:
            return 3
        if not self.enabled:
            return 4
        if self.dragging:
            return 6
        if self.jogging:
            return 8 if self.v4 else 11
        if self.paused:
            return 10
        return 7 if self.busy else 5

    @property
    def jogging(self) -> bool:
        """Whether a jog or another motion outside the queue runs."""
        queued = self.current is not None and isinstance(self.current[1], JogMotion)
        return queued or self.unqueued is not None

    @property
    def busy(self) -> bool:
        """Whether the arm moves or a motion is pending."""
        moving = bool(self.current or self.unqueued or self.queue or self._braking)
        return moving or self._servo.pending or not self._servo.arrived

    def power_on(self) -> bool:
        """Switch the power on; False while the emergency stop of V4 is pressed."""
        if self.pressed and self.v4:
            return False
        self.pressed = False
        # On V3 only PowerOn resets a software emergency stop.
        self.alarms = [a for a in self.alarms if a != EMERGENCY_STOP_ALARM]
        if not self.powered:
            self.powered, self.power_on_remaining = True, self.options.power_on_time
        return True

    def enable(self, *load: float) -> bool:
        """Enable the drives; False without power or with an alarm. An empty load is unchanged."""
        if not self.powered or self.power_on_remaining > 0.0 or self.alarms:
            return False
        if load:
            self.set_load(*load)
        self.stop()
        self.enabled, self.dragging = True, 0
        self.resume()
        self.speed_factor = 100
        return True

    def disable(self) -> None:
        """Stop and disable the drives."""
        self.stop()
        self.enabled, self.dragging = False, 0

    def clear_alarms(self) -> None:
        """Clear the alarms, unless the emergency stop is pressed."""
        if not self.pressed:
            self.alarms = []

    def stop(self) -> None:
        """Discard the queue and brake."""
        self.queue.clear()
        self.current = self.unqueued = None
        self._servo.drop()
        if np.any(self.target_speed):
            self._braking = Braking(self.target_speed.copy())

    def alarm(self, *numbers: int) -> None:
        """Raise alarms: the arm stops and discards its queue."""
        self.alarms += [n for n in numbers if n not in self.alarms]
        self.stop()
        self.dragging = 0
        # On V3 the queue stays blocked after an alarm until EnableRobot or Continue.
        self.queue_running = self.queue_running and self.v4
        overspeed = any(n in OVERSPEED_ALARMS for n in numbers)
        if EMERGENCY_STOP_ALARM in numbers or (overspeed and not self.v4):
            self.enabled = False
        if (EMERGENCY_STOP_ALARM in numbers and not self.v4) or (overspeed and not self.v4):
            self.powered = False

    def press_emergency_stop(self, pressed: bool = True) -> None:
        """Press the emergency stop, or release it."""
        self.pressed = pressed
        if pressed:
            self.alarm(EMERGENCY_STOP_ALARM)
            self.enabled = False

    def lose_power(self) -> None:
        """Cut the power; the brakes engage."""
        self.stop()
        self.powered = self.enabled = False
        self.dragging = 0

    def set_dragging(self, mode: int) -> None:
        """Begin hand guiding (1) or end it (0)."""
        self.stop()
        self.dragging = mode

    def pause(self) -> None:
        """Pause the queue."""
        if self.enabled:
            self.paused = True

    def resume(self) -> None:
        """End a pause, and unblock the queue."""
        self.paused = False
        self.queue_running = True

    def request_control(self) -> bool:
        """Switch the control mode to TCP; False while the arm is enabled."""
        if self.enabled:
            return False
        self.not_tcp = False
        return True

    def set_load(self, mass: float, *center: float) -> None:
        """Set the load at the flange [kg] and, unless empty, its centre [mm]."""
        self.load = mass
        self.load_center = np.array(center) if center else self.load_center

    def switch(self, port: int, on: int) -> None:
        """Switch an output."""
        bit = 1 << (port - 1)
        self.outputs = self.outputs | bit if on else self.outputs & ~bit

    def switch_tool(self, port: int, on: int) -> None:
        """Switch an output of the tool."""
        self.tool_outputs[port - 1] = on

    def place(self, flange: Transform, near: Joints) -> bool:
        """Put the flange at a pose instantly, which no real arm can do; False when out of reach."""
        joints = self.geometry.solve(flange, near)
        if joints is None:
            return False
        self.stop()
        self._braking = None
        self.target, self.joints = joints, joints.copy()
        self.target_speed, self.joint_speed = np.zeros(6), np.zeros(6)
        return True

    def enqueue(self, start: StartAction) -> int | None:
        """Append an entry to the queue; return its number, or None when the queue is full."""
        if len(self.queue) >= self.options.queue_depth:
            return None
        self.number += 1
        self.queue.append(QueueEntry(self.number, start))
        return self.number

    def count(self) -> int:
        """Return the number of a command that is done without the queue."""
        self.number += 1
        self.finished = self.number
        return self.number

    def stop_jog(self) -> None:
        """Brake a jog; a paused motion stays paused."""
        if self.current is not None and isinstance(self.current[1], JogMotion):
            self.stop()
        if self.unqueued is not None:
            self.unqueued = None
            self._braking = Braking(self.target_speed.copy())

    def follow_point(self, target: Joints, t: float, lookahead: float, gain: float) -> None:
        """Take a servo point; raises Alarm. See `ServoFollower.aim`."""
        self._servo.aim(self.time, self.target, target, t, lookahead, gain)

    # Stepping

    def advance(self, h: float) -> None:
        """Advance the time by `h` [s]."""
        self.time += h
        if self.power_on_remaining > 0.0:
            self.power_on_remaining = max(self.power_on_remaining - h, 0.0)
        before = self.target
        try:
            self._servo.aim_due(self.time, self.target)
            target = self._next_target(h)
            if self._braking is None:
                check_range(target, before)
            self.target = target
        except Alarm as alarm:
            self.target = before
            self.alarm(*alarm.numbers)
        speed = (self.target - before) / h
        self.target_acceleration, self.target_speed = (speed - self.target_speed) / h, speed
        lag = self._servo.lag
        share = 1.0 - np.exp(-h / lag) if lag > 0.0 else 1.0
        joints = self.joints + share * (self.target - self.joints)
        self.joint_speed, self.joints = (joints - self.joints) / h, joints

    def _next_target(self, h: float) -> Joints:
        if self._braking is not None:
            target = self._braking.advance(self.target, h)
            if self._braking.done:
                self._braking = None
            return target
        if not self.enabled or self.alarms or self.dragging:
            return self.target
        if self.unqueued is not None:
            return self.unqueued.advance(self.target, h)
        if self.paused or not self.queue_running:
            return self.target
        if self._servo.active:
            return self._follow_points(h)
        return self._run_queue(h)

    def _follow_points(self, h: float) -> Joints:
        target = self._servo.advance(self.target, self.target_speed, h)
        if self._servo.braking_from is not None:
            self._braking, self._servo.braking_from = Braking(self._servo.braking_from), None
        return target

    def _run_queue(self, h: float) -> Joints:
        while self.current is None and self.queue:
            entry = self.queue.popleft()
            self.finished = entry.number
            motion = entry.start(self.target)
            if motion is not None:
                self.current = (entry.number, motion)
        if self.current is None:
            return self.target
        target = self.current[1].advance(self.target, h)
        if self.current[1].done:
            self.current = None
        return target

    # Kinematics

    def flange(self, joints: Joints) -> Transform:
        """Return the pose of the flange in the base [m]."""
        return self.geometry.flange(joints)
