"""The emulated arm's controller: power, modes, alarms, queue and drives; no text, no socket."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from services.cr5_emulator.geometry import CALIBRATED, NOMINAL, Joints, Transform
from services.cr5_emulator.motions import Alarm, Braking, JogMotion, Motion, check_range
from services.cr5_emulator.options import Options
from services.cr5_emulator.preferences import Preferences
from services.cr5_emulator.stream import Stream

Start = Callable[[Joints], Motion | None]
"""What a queue entry does when its turn comes; a motion if it takes time."""

EMERGENCY = 116
COLLISION = 117


@dataclass
class Entry:
    """One entry of the queue."""

    number: int
    start: Start


class Controller:
    """State of the emulated arm, stepped in time."""

    def __init__(self, options: Options) -> None:
        self.options = options
        self.v4 = options.firmware == "v4"
        self.geometry = CALIBRATED if options.calibrated else NOMINAL
        self.target: Joints = np.radians(options.joints)
        """What the drives follow [rad]."""
        self.target_speed = np.zeros(6)
        self.target_acceleration = np.zeros(6)
        self.joints = self.target.copy()
        self.joint_speed = np.zeros(6)
        self.time = 0.0
        """Since the start [s]."""
        self.powered = options.powered
        self.power_left = 0.0
        self.enabled = False
        self.dragging = 0
        """1 by the joints, 2 by the force sensor."""
        self.pressed = False
        """The emergency stop."""
        self.alarms: list[int] = []
        self.brakes = [False] * 6
        self.paused = False
        self.paused_at: Joints | None = None
        self.script = ""
        """Name of the one that runs or is paused."""
        self._script_left = 0.0
        self.queue_running = True
        self.queue: deque[Entry] = deque()
        self.current: tuple[int, Motion] | None = None
        self.alone: Motion | None = None
        """A jog or the like, which goes past the queue, in a pause too."""
        self._later: list[tuple[float, Callable[[], None]]] = []
        self.number = 0
        """Of the entry queued last."""
        self.finished = 0
        """Of the entry begun last."""
        self._stream = Stream(options)
        self._braking: Braking | None = None
        self.speed_factor = 100
        self.outputs = 0
        self.inputs = 0
        self.tool_outputs = [0, 0]
        self.analog = [0.0, 0.0]
        self.user = self.tool = 0
        self.users: dict[int, np.ndarray] = {0: np.zeros(6)}
        self.tools: dict[int, np.ndarray] = {0: np.zeros(6)}
        self.load = 0.0
        self.load_center = np.zeros(3)
        self.ratios = dict.fromkeys(("accj", "accl", "speedj", "speedl"), 100 if self.v4 else 50)
        self.preferences = Preferences(blending=0 if self.v4 else 50)

    # What people and commands do to it

    @property
    def mode(self) -> int:
        """RobotMode, whose 8 and 11 differ between V3 and V4."""
        if self.alarms:
            return 11 if self.v4 and COLLISION in self.alarms else 9
        if self.power_left > 0.0:
            return 1
        if not self.powered:
            return 3
        if any(self.brakes):
            return 2
        if not self.enabled:
            return 4
        if self.dragging:
            return 6
        if self.jogging:
            return 8 if self.v4 else 11
        if self.paused:
            return 10
        return 7 if self.busy or self.script else 5

    @property
    def jogging(self) -> bool:
        """Whether a jog or another motion past the queue runs."""
        queued = self.current is not None and isinstance(self.current[1], JogMotion)
        return queued or self.alone is not None

    @property
    def busy(self) -> bool:
        """Whether something moves or waits to."""
        moving = bool(self.current or self.alone or self.queue or self._braking)
        return moving or self._stream.waits or not self._stream.arrived

    def power_on(self) -> bool:
        if self.pressed and self.v4:
            return False
        self.pressed = False
        # On V3 this alone resets a software emergency stop.
        self.alarms = [a for a in self.alarms if a != EMERGENCY]
        if not self.powered:
            self.powered, self.power_left = True, self.options.power_on_time
        return True

    def enable(self) -> bool:
        if not self.powered or self.power_left > 0.0 or self.alarms or any(self.brakes):
            return False
        self.stop()
        self.enabled, self.dragging = True, 0
        self.go_on()
        self.speed_factor = 100
        return True

    def disable(self) -> None:
        self.stop()
        self.enabled, self.dragging = False, 0

    def clear_alarms(self) -> None:
        if not self.pressed:
            self.alarms = []

    def stop(self) -> None:
        """Drops the queue and brakes."""
        self.queue.clear()
        self.current = self.alone = None
        self.script = ""
        self._stream.drop()
        if np.any(self.target_speed):
            self._braking = Braking(self.target_speed.copy())

    def alarm(self, *numbers: int) -> None:
        """Raises alarms: the arm stops by itself and drops what it had to do."""
        self.alarms += [n for n in numbers if n not in self.alarms]
        self.stop()
        self.dragging = 0
        # On V3 the queue stays shut behind an alarm until EnableRobot or Continue.
        self.queue_running = self.queue_running and self.v4
        overspeed = any(48 <= n <= 53 for n in numbers)
        if EMERGENCY in numbers or (overspeed and not self.v4):
            self.enabled = False
        if (EMERGENCY in numbers and not self.v4) or (overspeed and not self.v4):
            self.powered = False

    def press(self) -> None:
        """The emergency stop."""
        self.pressed = True
        self.alarm(EMERGENCY)
        self.enabled = False

    def lose_power(self) -> None:
        """The arm's power goes away; its brakes fall."""
        self.stop()
        self.powered = self.enabled = False
        self.dragging = 0

    def drag(self, how: int) -> None:
        """Begins (1, 2) or ends (0) to be guided by hand."""
        self.stop()
        self.dragging = how

    def pause(self) -> None:
        """Holds the queue, or the script."""
        if self.enabled:
            self.paused, self.paused_at = True, self.target.copy()

    def go_on(self) -> None:
        """Ends a pause; a queue that was blocked runs again too."""
        self.paused, self.paused_at = False, None
        self.queue_running = True

    def run_script(self, name: str) -> bool:
        """Begins one of the controller's scripts, which stand still for a while."""
        if not self.enabled or self.busy or self.script or name not in self.options.scripts:
            return False
        self.script, self._script_left = name, self.options.script_time
        return True

    def pause_script(self, pause: bool) -> bool:
        if not self.script:
            return False
        if pause:
            self.pause()
        else:
            self.go_on()
        return True

    def stop_script(self) -> None:
        if self.script:
            self.stop()
            self.go_on()

    def place(self, flange: Transform, near: Joints) -> bool:
        """Puts the arm somewhere at once; nothing that a real one could do."""
        joints = self.geometry.solve(flange, near)
        if joints is None:
            return False
        self.stop()
        self._braking = None
        self.target, self.joints = joints, joints.copy()
        self.target_speed, self.joint_speed = np.zeros(6), np.zeros(6)
        return True

    def enqueue(self, start: Start) -> int | None:
        """Puts an entry behind the others; its number, or None when the queue is full."""
        if len(self.queue) >= self.options.queue_depth:
            return None
        self.number += 1
        self.queue.append(Entry(self.number, start))
        return self.number

    def move_alone(self, motion: Motion) -> None:
        """Begins a motion at once, past the queue."""
        self.alone = motion

    def stop_jog(self) -> None:
        """Brakes a jog, and leaves what is paused."""
        if self.current is not None and isinstance(self.current[1], JogMotion):
            self.stop()
        self.stop_single()

    def stop_single(self) -> None:
        """Brakes what goes past the queue."""
        if self.alone is not None:
            self.alone = None
            self._braking = Braking(self.target_speed.copy())

    def later(self, delay: float, action: Callable[[], None]) -> None:
        """Does something after a delay [s]."""
        self._later.append((self.time + delay, action))

    def aim(self, target: Joints, t: float, lookahead: float, gain: float) -> None:
        """A servo point; may raise Alarm."""
        self._stream.aim(self.time, self.target, target, t, lookahead, gain)

    # Time

    def advance(self, h: float) -> None:
        """One step of `h` [s]."""
        self.time += h
        if self.power_left > 0.0:
            self.power_left = max(self.power_left - h, 0.0)
        self._advance_script(h)
        for due, action in [row for row in self._later if row[0] <= self.time]:
            self._later.remove((due, action))
            action()
        before = self.target
        try:
            self._stream.aim_due(self.time, self.target)
            target = self._next_target(h)
            if self._braking is None:
                check_range(target, self.preferences.axis_limits, before)
            self.target = target
        except Alarm as alarm:
            self.target = before
            self.alarm(*alarm.numbers)
        speed = (self.target - before) / h
        self.target_acceleration, self.target_speed = (speed - self.target_speed) / h, speed
        lag = self._stream.lag
        share = 1.0 - np.exp(-h / lag) if lag > 0.0 else 1.0
        joints = self.joints + share * (self.target - self.joints)
        self.joint_speed, self.joints = (joints - self.joints) / h, joints

    def _advance_script(self, h: float) -> None:
        if self.script and not self.paused:
            self._script_left -= h
            if self._script_left <= 0.0:
                self.script = ""

    def _next_target(self, h: float) -> Joints:
        if self._braking is not None:
            target = self._braking.advance(self.target, h)
            if self._braking.done:
                self._braking = None
            return target
        if not self.enabled or self.alarms or self.dragging:
            return self.target
        if self.alone is not None:
            target = self.alone.advance(self.target, h)
            if self.alone.done:
                self.alone = None
            return target
        if self.paused or not self.queue_running:
            return self.target
        if self._stream.leads:
            return self._follow(h)
        return self._queue(h)

    def _follow(self, h: float) -> Joints:
        target = self._stream.advance(self.target, self.target_speed, h)
        if self._stream.braking_from is not None:
            self._braking, self._stream.braking_from = Braking(self._stream.braking_from), None
        return target

    def _queue(self, h: float) -> Joints:
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

    # Where it is

    def flange(self, joints: Joints) -> Transform:
        """Pose of the flange in the base [m]."""
        return self.geometry.flange(joints)
