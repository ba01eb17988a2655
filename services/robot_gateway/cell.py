"""A cell: all arms that hold one rope, stepped with chunks, commands, obstacles and time.

Every tick judges the watchdog, moves the command or its stop, hands it to the arms and judges what
they say of themselves. All arms stop together, because rules between the ends tie them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from lariat.geometry.obstacles import Obstacle
from lariat.geometry.poses import Pose
from lariat.trajectory import NANOSECONDS, SetpointChunk
from services.robot_gateway.arms import SIDES, Arms
from services.robot_gateway.constraints.rule import Rule
from services.robot_gateway.drivers.driver import Driver
from services.robot_gateway.motion.approach import (
    PACES,
    TOO_FAST,
    Approach,
    slow_chunk,
)
from services.robot_gateway.motion.follower import Guidance
from services.robot_gateway.motion.setpoint_sources import Writers
from services.robot_gateway.motion.validation import Refused
from services.robot_gateway.safety.force_limit import Pulls
from services.robot_gateway.safety.state_machine import (
    DEVICE_CAUSES,
    Command,
    Rejected,
    Safety,
)
from services.robot_gateway.safety.stop_causes import CAUSES
from services.robot_gateway.status import CellReport

TICK = 0.008
"""Period of the gateway [s]."""
SILENCE = 0.1
"""Age of the last fresh chunk at which the cell holds for a person [s]."""
LATE = 0.05
"""Age at which it begins to brake, without holding yet [s]: an arm follows its command some 80 ms
later, and it must have begun to brake within 150 ms."""
FOLLOWING = 0.3
"""Time after the command's rest within which an arm must have come to rest too [s]."""
PATIENCE = 30.0
"""Time that an arm has to become ready [s]."""


class Cell:
    """All arms of a cell."""

    def __init__(
        self,
        guidance: Guidance,
        drivers: Sequence[Driver],
        starts: Sequence[Pose],
        boot: str,
        arm_automatically: bool = False,
        pulls: Pulls | None = None,
    ) -> None:
        """Args: starts: Grips of all ends at the scenario's start. boot: Id of this start."""
        self.guidance = guidance
        self.arms = Arms(drivers, starts)
        self.arm_automatically = arm_automatically
        self.safety = Safety(boot)
        self._writers = Writers()
        self._approach = Approach()
        self._pulls = pulls or Pulls(np.inf)
        self._last_tick: int | None = None
        self._last_fresh = 0
        self._late = False
        self._waits_since: int | None = None
        self._stalled = False
        self._planned = False
        """Whether the tick before took its time over the way to the start, while all rested."""
        self._moved = 0
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
                    self.safety = self.safety.acknowledged()
                    self._pulls.acknowledge(self.arms.pulls)
                    self._wait_for_arms(now)
                    self.arms.recover()
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
        # A controller that has nothing to do holds all the time; the way to the start is not its.
        if self.safety.may_move and not self._approach.running:
            self.safety = self.safety.stopped("writer_holds", reason or "the controller holds")
            self.guidance.halt()

    def take_chunk(self, chunk: SetpointChunk, session: str, sequence: int, now: int) -> None:
        """Setpoints that arrived at `now` [ns]."""
        try:
            offset = self._take_writer(session, sequence, now, chunk.start)
            if not self.safety.may_move or self._waits_since is not None:
                return
            if self._reset_wanted != self._reset_done or self._approach.running:
                return
            spline = self.guidance.check(chunk, now, offset)
        except Refused as refused:
            self._refuse(refused, sequence)
            if refused.rule not in ("ordered", "fresh"):
                # The writer lives: the chunk before may run to its resting end.
                self._last_fresh = now
            return
        self._last_fresh, self._sequence = now, sequence
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
        self.wake(now)
        elapsed = self._elapsed(now)
        self._last_tick, self._planned = now, False
        h = min(elapsed, 3.0 * TICK)
        self._watch(now, h)
        if h > 0.0:
            self._late = (now - self._last_fresh) * NANOSECONDS + h > LATE
            rule = self.guidance.step(now - round(h / NANOSECONDS), now, self._late)
            self._rule = rule or self._rule
        if not self.guidance.resting:
            self._moved = now
        elif not self.guidance.following:
            self.safety = self.safety.moving(False)
            self._reset_when_asked(now)
        self.arms.exchange(now, self.guidance, self._points_go())
        self._judge_arms(now)
        return self._report()

    def wake(self, now: int) -> None:
        """Notices that the gateway stood still, before it believes what waited for it meanwhile."""
        elapsed = self._elapsed(now)
        moved = self.safety.mode == "moving" or not self.guidance.resting
        if elapsed <= SILENCE or not moved or self._stalled or self._planned:
            return
        self._halt("stalled", f"the gateway stood still for {elapsed:.3f} s")
        if self.arms.on_their_own:
            # They have stopped by themselves; what the command still had to go is not sent.
            self._waits_since, self._stalled = now, True

    def _elapsed(self, now: int) -> float:
        """Since the last tick [s]."""
        return TICK if self._last_tick is None else (now - self._last_tick) * NANOSECONDS

    def _watch(self, now: int, h: float) -> None:
        """Stops what may not go on."""
        if not self.guidance.following:
            self._approach.running = False
            return
        if self._approach.running:
            # Nobody else keeps this way fresh; a person's hold ends it.
            self._last_fresh = now
        if self.guidance.finished(now):
            self.guidance.halt()
            return
        # What the next tick would find too late is stopped now.
        if (now - self._last_fresh) * NANOSECONDS + h > SILENCE:
            if self.guidance.arrived(now):
                self.guidance.halt()
            else:
                silent = f"no fresh setpoints for {1e3 * SILENCE:.0f} ms"
                self._halt("silence", f"{silent}: controller, bus or network dead or stopped")
            return
        behind, turn = self.guidance.behind(now)
        tolerances = self.guidance.tolerances
        if behind > 2.0 * tolerances.step or turn > 2.0 * tolerances.turn:
            far = f"{1e3 * behind:.0f} mm and {turn:.2f} rad"
            self._halt("left_behind", f"{far} behind its setpoints")

    def _halt(self, cause: str, detail: str) -> None:
        self.safety = self.safety.stopped(cause, detail)
        self._rule = CAUSES[cause].rule or self._rule
        self.guidance.halt()

    def _reset_when_asked(self, now: int) -> None:
        if self._reset_wanted == self._reset_done:
            return
        self._reset_done = self._reset_wanted
        self.arms.place(range(len(self.arms.drivers)))
        self.guidance.place(self.arms.grips)
        if self.safety.mode != "disarmed":
            self._waits_since = now

    def _report(self) -> CellReport:
        return CellReport(
            self.safety,
            (self._late or not self.guidance.following) and not self.guidance.resting,
            self._rule,
            self._refusal,
            self._sequence,
            self._refused_sequence,
            self._command,
            self._rejection,
            self.arms.feedback,
            tuple(self.arms.lags()),
            self._reset_done,
        )

    # Writers

    def _take_writer(self, session: str, sequence: int, now: int, start: int) -> int:
        """Lets a writer in; the offset from its clock to ours [ns]."""
        before = self.safety.cause
        self.safety, answer = self._writers.take(self.safety, session, sequence, now, start)
        if self.safety.cause == "new_writer" and before != "new_writer":
            self.guidance.halt()
        if isinstance(answer, Refused):
            raise answer
        return answer

    def _refuse(self, refused: Refused, sequence: int) -> None:
        self._rule, self._refusal = refused.rule, str(refused)
        self._refused_sequence = sequence

    # Persons

    def _arm(self, now: int) -> None:
        away = self.arms.away
        refusal = self.arms.trouble or self._approach.refusal(
            [SIDES[k] for k in away],
            [self.arms.grips[k] for k in away],
            [self.arms.starts[k] for k in away],
            now,
        )
        self.safety = self.safety.armed(refusal)
        self._enable(now)

    def _arm_by_itself(self, now: int) -> None:
        """A simulated cell needs no person; its arms are put where the scenario begins."""
        self.arms.place(self.arms.away)
        self.safety = replace(self.safety.armed(), detail="armed by the scenario")
        self._enable(now)

    def _enable(self, now: int) -> None:
        self._wait_for_arms(now)
        self.arms.enable()

    def close(self) -> None:
        """Ends the connections to the arms."""
        self.arms.close()

    def _wait_for_arms(self, now: int) -> None:
        self._waits_since = now
        self._rule, self._refusal = None, ""

    def _grip(self, command: Command) -> None:
        if not self.guidance.resting:
            raise Rejected("a gripper opens and closes only while the arms rest; hold first")
        self.arms.grip(command)

    def _begin_approach(self, now: int) -> None:
        self._approach.wanted, self._planned = False, True
        driven = self.guidance.driven
        grips = [self.arms.grips[k] for k in driven]
        starts = [self.arms.starts[k] for k in driven]
        for pace in PACES:
            try:
                chunk = slow_chunk(grips, starts, now, pace)
                self.guidance.follow(self.guidance.check(chunk, now), now)
            except Refused as refused:
                if refused.rule in TOO_FAST and pace != PACES[-1]:
                    continue
                self._refuse(refused, 0)
                self.safety = self.safety.disarmed(f"the way to the start is barred: {refused}")
                return
            self._approach.running = True
            self.safety = self.safety.moving(True)
            return

    # Arms

    def _judge_arms(self, now: int) -> None:
        for name, feedback in zip(SIDES, self.arms.feedback, strict=False):
            if feedback.fault not in DEVICE_CAUSES or self.safety.mode in ("disarmed", "fault"):
                continue
            words = "; ".join(feedback.alarms)
            self._halt(feedback.fault, f"{name}: {words or feedback.fault}")
            self._waits_since = None
        if self.safety.mode == "disarmed":
            # Power goes when the arms rest, not already when their command does.
            behind = self.arms.powered and (now - self._moved) * NANOSECONDS < FOLLOWING
            if self.guidance.resting and (self.arms.still or not behind):
                self._waits_since = None
                self.arms.disable()
                self.arms.measure(self.guidance)
                self._stalled = False
                alone = self.arm_automatically and self.safety.cause == "boot"
                if alone and not self.arms.trouble:
                    self._arm_by_itself(now)
        elif self._waits_since is not None:
            self._finish_waiting(now)
        elif self.safety.mode != "fault":
            self._judge_tracking()
            self._judge_pulls()

    def _points_go(self) -> list[bool]:
        """To which ends: those that brake get theirs until they rest, whatever the cell's mode.

        Only an arm that has failed gets none, or that something has taken far from its path, where
        a point would make it jump back; and all that stood still while the gateway did.
        """
        if self._stalled:
            return [False] * len(self.arms.drivers)
        if self.guidance.resting:
            live = self.safety.mode not in ("disarmed", "fault") and self._waits_since is None
            return [live and near for near in self.arms.near(1.0)]
        return [a and b for a, b in zip(self.arms.sound, self.arms.near(2.0), strict=True)]

    def _finish_waiting(self, now: int) -> None:
        if self.arms.ready and self.guidance.resting:
            self.arms.measure(self.guidance)
            self._waits_since, self._stalled = None, False
            if self._approach.wanted:
                self._begin_approach(now)
        elif (now - (self._waits_since or now)) * NANOSECONDS > PATIENCE:
            self._waits_since, self._stalled = None, False
            self._halt("alarm", f"not ready after {PATIENCE:.0f} s: {self.arms.unready}")

    def _judge_tracking(self) -> None:
        lags, near = self.arms.lags(), self.arms.near(1.0)
        for name, lag, close in zip(SIDES, lags, near, strict=False):
            if not close:
                self._halt("tracking", f"{name}: {1e3 * lag:.0f} mm off its command")

    def _judge_pulls(self) -> None:
        pulls = self.arms.pulls
        end = self._pulls.broken(pulls)
        if end is not None:
            felt = f"{SIDES[end]} feels {pulls[end]:.0f} N more than at rest"
            self._halt("pulled", f"{felt}; limits.pull is {self._pulls.limit:.0f} N")
