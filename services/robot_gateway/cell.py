"""A cell: all arms that hold one rope, stepped with chunks, commands, obstacles and time.

Every tick judges the watchdog, moves the command or its stop, hands it to the arms and judges what
they say of themselves. All arms stop together, because rules between the ends tie them.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from services.robot_gateway import approach
from services.robot_gateway.admission import Refused
from services.robot_gateway.causes import CAUSES
from services.robot_gateway.drivers.driver import Driver, Feedback
from services.robot_gateway.guidance import Guidance
from services.robot_gateway.limits import Rule
from services.robot_gateway.safety import DEVICE_CAUSES, Command, Rejected, Safety
from services.robot_gateway.trajectory import NANOSECONDS, Chunk
from shared.geometry.obstacles import Obstacle
from shared.geometry.poses import Pose

SIDES = ("left", "right")

TICK = 0.008
"""Period of the gateway [s]."""
SILENCE = 0.1
"""Age of the last fresh chunk at which braking has begun [s]."""
CLOCK_ERROR = 0.25
"""A first chunk further from the present than this comes from another clock [s]."""
PATIENCE = 30.0
"""Time that an arm has to become ready [s]."""
AGREEMENT = 30.0
"""In which a person may arm again to agree to an approach [s]."""
LAG = 0.5
"""How far back the command is searched for where an arm is now [s]."""


@dataclass(frozen=True)
class CellReport:
    """The cell after a tick."""

    safety: Safety
    braking: bool
    rule: Rule | None
    """Hit last."""
    refusal: str
    """Why the chunk refused last was refused."""
    sequence: int
    """Of the chunk accepted last."""
    refused_sequence: int
    command: str
    """Id of the command handled last."""
    rejection: str
    """Why that command was not carried out."""
    arms: tuple[Feedback, ...]
    tracking: tuple[float, ...]
    """Distance between command and feedback [m]."""
    reset_count: int
    """Of the reset carried out last."""


class Cell:
    """All arms of a cell."""

    def __init__(
        self,
        guidance: Guidance,
        drivers: Sequence[Driver],
        starts: Sequence[Pose],
        boot: str,
        arm_automatically: bool = False,
    ) -> None:
        """Args: starts: Grips of all ends at the scenario's start. boot: Id of this start."""
        self.guidance = guidance
        self.drivers = tuple(drivers)
        self.starts = tuple(starts)
        self.arm_automatically = arm_automatically
        self.safety = Safety(boot)
        self._grips = list(starts)
        self._feedback: tuple[Feedback, ...] = ()
        self._trail: deque[tuple[int, np.ndarray]] = deque()
        self._last_tick: int | None = None
        self._last_fresh = 0
        self._numbers: tuple[str, int, int] = ("", -1, 0)
        self._waits_since: int | None = None
        self._powered = False
        self._approaches = self._approaching = False
        self._agreement_ends = 0
        self._rule: Rule | None = None
        self._refusal = self._command = self._rejection = ""
        self._sequence = self._refused_sequence = 0
        self._reset_wanted = self._reset_done = 0

    # What arrives

    def take_scene(self, obstacles: Sequence[Obstacle]) -> None:
        """Obstacles as they are now."""
        self.guidance.rules.replace_obstacles(obstacles)

    def take_command(self, command: Command, now: int) -> None:
        """A person's command."""
        self._command, self._rejection = command.id, ""
        try:
            self.safety.check(command, now)
            match command.action:
                case "arm":
                    self._arm(now)
                case "disarm":
                    self.disarm()
                case "hold":
                    self.safety = self.safety.stopped("person", "held by a person")
                    self.guidance.halt()
                case "acknowledge":
                    self._acknowledge(now)
                case "gripper":
                    self._grip(command)
        except Rejected as rejection:
            self._rejection = str(rejection)

    def disarm(self) -> None:
        """Brakes and, once at rest, takes the arms' power away."""
        self.safety = self.safety.disarmed()
        self.guidance.halt()

    def take_hold(self, session: str, sequence: int, now: int, reason: str) -> None:
        """A writer stands still on purpose."""
        try:
            self._take_writer(session, sequence, now, now)
        except Refused as refused:
            self._refuse(refused, sequence)
            return
        self._last_fresh, self._sequence = now, sequence
        if self.safety.may_move:
            self.safety = self.safety.stopped("writer_holds", reason or "the controller holds")
            self.guidance.halt()

    def take_chunk(self, chunk: Chunk, now: int) -> None:
        """Setpoints that arrived at `now` [ns]."""
        try:
            offset = self._take_writer(chunk.session, chunk.sequence, now, chunk.start)
            if not self.safety.may_move or self._waits_since is not None:
                return
            if self._reset_wanted != self._reset_done or self._approaching:
                return
            spline = self.guidance.check(chunk, now, offset)
        except Refused as refused:
            self._refuse(refused, chunk.sequence)
            if refused.rule not in ("ordered", "fresh"):
                # The writer lives: the chunk before may run to its resting end.
                self._last_fresh = now
            return
        self._last_fresh, self._sequence = now, chunk.sequence
        self.guidance.follow(spline, now)
        self.safety = self.safety.moving(True)

    def take_reset(self, count: int) -> None:
        """Back to the scenario's start once everything rests; simulation only."""
        if count != self._reset_wanted:
            self._reset_wanted = count
            self.guidance.halt()

    # The tick

    def step(self, now: int) -> CellReport:
        """One tick at `now` [ns]."""
        elapsed = TICK if self._last_tick is None else (now - self._last_tick) * NANOSECONDS
        self._last_tick = now
        if elapsed > SILENCE and self.safety.mode == "moving":
            self._halt("stalled", f"the gateway stood still for {elapsed:.3f} s")
        h = min(elapsed, 3.0 * TICK)
        self._watch(now, h)
        if h > 0.0:
            rule = self.guidance.step(now - round(h / NANOSECONDS), now)
            self._rule = rule or self._rule
        if not self.guidance.following and self.guidance.resting:
            self.safety = self.safety.moving(False)
            self._reset_when_asked(now)
        self._exchange(now)
        self._judge_arms(now)
        return CellReport(
            self.safety,
            not self.guidance.following and not self.guidance.resting,
            self._rule,
            self._refusal,
            self._sequence,
            self._refused_sequence,
            self._command,
            self._rejection,
            self._feedback,
            tuple(self._lags()),
            self._reset_done,
        )

    def _watch(self, now: int, h: float) -> None:
        """Stops what may not go on."""
        if not self.guidance.following:
            self._approaching = False
            return
        if self._approaching:
            # Nobody else keeps this way fresh; a person's hold ends it.
            self._last_fresh = now
        if self.guidance.finished(now):
            self.guidance.halt()
            return
        # What the next tick would find too late is stopped now.
        if (now - self._last_fresh) * NANOSECONDS + h > SILENCE:
            if self.guidance.resting:
                self.guidance.halt()
            else:
                silent = f"no fresh setpoints for {1e3 * SILENCE:.0f} ms"
                self._halt("silence", f"{silent}: controller, bus or network dead or stopped")
            return
        behind = self.guidance.behind(now)
        if behind > 2.0 * self.guidance.tolerances.step:
            self._halt("left_behind", f"{1e3 * behind:.0f} mm behind its setpoints")

    def _halt(self, cause: str, detail: str) -> None:
        self.safety = self.safety.stopped(cause, detail)
        self._rule = CAUSES[cause].rule or self._rule
        self.guidance.halt()

    def _reset_when_asked(self, now: int) -> None:
        if self._reset_wanted == self._reset_done:
            return
        self._reset_done = self._reset_wanted
        for k, driver in enumerate(self.drivers):
            if driver.place(self.starts[k]):
                self._grips[k] = self.starts[k]
        self.guidance.place(self._grips)
        if self.safety.mode != "disarmed":
            self._waits_since = now

    # Writers

    def _take_writer(self, session: str, sequence: int, now: int, start: int) -> int:
        """Lets a writer in; the offset from its clock to ours [ns]."""
        if not session:
            raise Refused("ordered", "the writer gives no session")
        before = self.safety
        self.safety = before.written(session)
        if self.safety.cause == "new_writer" and before.cause != "new_writer":
            self.guidance.halt()
        if self.safety.session not in ("", session):
            raise Refused("ordered", f"writer {session!r} is not the one that is followed")
        known, last, offset = self._numbers
        if known != session:
            # Another machine's clock: its first message says how far it is off.
            apart = now - start
            offset = apart if abs(apart) * NANOSECONDS > CLOCK_ERROR else 0
        elif sequence <= last:
            raise Refused("ordered", f"sequence {sequence} after {last}")
        self._numbers = (session, sequence, offset)
        return offset

    def _refuse(self, refused: Refused, sequence: int) -> None:
        self._rule, self._refusal = refused.rule, str(refused)
        self._refused_sequence = sequence

    # Persons

    def _arm(self, now: int) -> None:
        self.safety = self.safety.armed(self._trouble() or self._refusal_to_approach(now))
        self._enable(now)

    def _arm_by_itself(self, now: int) -> None:
        """A simulated cell needs no person; its arms are put where the scenario begins."""
        away = [k for k in self.guidance.driven if approach.is_away(self._grips[k], self.starts[k])]
        for k in away:
            self.drivers[k].place(self.starts[k])
        self.safety = replace(self.safety.armed(), detail="armed by the scenario")
        self._enable(now)

    def _enable(self, now: int) -> None:
        self._wait_for_arms(now)
        for driver in self.drivers:
            driver.enable()

    def _acknowledge(self, now: int) -> None:
        self.safety = self.safety.acknowledged()
        self._wait_for_arms(now)
        for driver in self.drivers:
            driver.recover()

    def _disable(self) -> None:
        """Takes the power off arms that rest, once after each time they had it."""
        if self._powered:
            self._powered = False
            for driver in self.drivers:
                driver.disable()

    def close(self) -> None:
        """Ends the connections to the arms."""
        for driver in self.drivers:
            driver.close()

    def _wait_for_arms(self, now: int) -> None:
        self._waits_since = now
        self._powered = True
        self._rule, self._refusal = None, ""

    def _grip(self, command: Command) -> None:
        if command.arm not in SIDES:
            raise Rejected(f"there is no arm {command.arm!r}; there are {', '.join(SIDES)}")
        driver = self.drivers[SIDES.index(command.arm)]
        if not driver.moves:
            raise Rejected(f"{command.arm} is fixed and has no gripper")
        if not self.guidance.resting:
            raise Rejected("a gripper opens and closes only while the arms rest; hold first")
        driver.grip(command.close)

    def _refusal_to_approach(self, now: int) -> str:
        """Arming an arm that is not at the start takes a second word from the person."""
        away = [k for k in self.guidance.driven if approach.is_away(self._grips[k], self.starts[k])]
        agreed = now <= self._agreement_ends
        self._agreement_ends = 0
        self._approaches = bool(away)
        if not away or agreed:
            return ""
        self._agreement_ends = now + round(AGREEMENT / NANOSECONDS)
        words = []
        for k in away:
            far, turn = approach.distance(self._grips[k], self.starts[k])
            words.append(f"{SIDES[k]} is {1e3 * far:.0f} mm and {turn:.2f} rad from the start")
        return (
            f"{', '.join(words)}; arm again within {AGREEMENT:.0f} s to let it go there straight "
            f"at {1e3 * approach.SPEED:.0f} mm/s, or jog it there first"
        )

    def _begin_approach(self, now: int) -> None:
        self._approaches = False
        driven = self.guidance.driven
        chunk = approach.slow_chunk(
            [self._grips[k] for k in driven], [self.starts[k] for k in driven], now
        )
        try:
            self.guidance.follow(self.guidance.check(chunk, now), now)
        except Refused as refused:
            self._refuse(refused, 0)
            self.safety = self.safety.disarmed(f"the way to the start is barred: {refused}")
            return
        self._approaching = True
        self.safety = self.safety.moving(True)

    def _trouble(self) -> str:
        """What keeps the cell from being armed."""
        for name, feedback in zip(SIDES, self._feedback, strict=False):
            if feedback.fault:
                return f"{name}: {'; '.join(feedback.alarms) or feedback.fault}"
            if feedback.pose is None:
                return f"{name}: its pose is not known yet"
        return "" if self._feedback else "the arms have not been heard yet"

    # Arms

    def _exchange(self, now: int) -> None:
        """Commands to the arms, feedback from them."""
        rows = []
        driven = iter(self.guidance.grips())
        # After a fault the command brakes for the others, but the arm that failed gets no points.
        live = self.safety.mode not in ("disarmed", "fault") and self._waits_since is None
        for driver in self.drivers:
            pose, velocity = next(driven) if driver.moves else (None, np.zeros((2, 3)))
            rows.append(driver.step(now, pose if live else None, velocity))
        self._feedback = tuple(rows)
        self._trail.append((now, self.guidance.state.position))
        while (now - self._trail[0][0]) * NANOSECONDS > LAG:
            self._trail.popleft()

    def _judge_arms(self, now: int) -> None:
        for name, feedback in zip(SIDES, self._feedback, strict=False):
            if feedback.fault not in DEVICE_CAUSES or self.safety.mode in ("disarmed", "fault"):
                continue
            words = "; ".join(feedback.alarms)
            self._halt(feedback.fault, f"{name}: {words or feedback.fault}")
            self._waits_since = None
        if self.safety.mode == "disarmed":
            if self.guidance.resting:
                self._waits_since = None
                self._disable()
                self._take_measured()
                if self.arm_automatically and self.safety.cause == "boot" and not self._trouble():
                    self._arm_by_itself(now)
        elif self._waits_since is not None:
            self._finish_waiting(now)
        elif self.safety.mode != "fault":
            self._judge_tracking()

    def _finish_waiting(self, now: int) -> None:
        if all(f.ready and f.pose is not None for f in self._feedback) and self.guidance.resting:
            self._take_measured()
            self._waits_since = None
            if self._approaches:
                self._begin_approach(now)
        elif (now - (self._waits_since or now)) * NANOSECONDS > PATIENCE:
            slow = [
                f"{n}: {'; '.join(f.alarms) or 'not ready'}"
                for n, f in zip(SIDES, self._feedback, strict=False)
                if not f.ready
            ]
            self._waits_since = None
            self._halt("alarm", f"not ready after {PATIENCE:.0f} s: {', '.join(slow)}")

    def _take_measured(self) -> None:
        """Starts the command from where the arms are."""
        for k, feedback in enumerate(self._feedback):
            if feedback.pose is not None:
                self._grips[k] = feedback.pose
            posture = self.drivers[k].posture
            if posture is not None and feedback.joints:
                posture.begin(feedback.joints)
        self.guidance.place(self._grips)
        self._trail.clear()

    def _judge_tracking(self) -> None:
        for driver, name, lag in zip(self.drivers, SIDES, self._lags(), strict=False):
            if lag > driver.tracking_limit:
                self._halt("tracking", f"{name}: {1e3 * lag:.0f} mm off its command")

    def _lags(self) -> list[float]:
        """Distance of every arm to the nearest place it was commanded to be lately [m].

        An arm follows some time behind; what counts is how far it is off its path.
        """
        driven = 0
        lags = []
        for driver, feedback in zip(self.drivers, self._feedback, strict=True):
            if not driver.moves:
                lags.append(0.0)
                continue
            if np.isinf(driver.tracking_limit):
                driven += 1
                lags.append(0.0)
                continue
            trail = [p[driven] for _, p in self._trail]
            driven += 1
            if feedback.pose is None or not trail:
                lags.append(0.0)
            else:
                gaps = np.linalg.norm(np.array(trail) - feedback.pose.position, axis=1)
                lags.append(float(np.min(gaps)))
        return lags
