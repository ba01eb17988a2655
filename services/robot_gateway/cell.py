"""Cell: all arms that hold one rope, stepped with chunks, commands, obstacles and time.

Every tick checks the watchdog and the newest chunk, advances the commanded motion or its stop,
sends it to the arms and checks their feedback. All arms stop together, because some rules couple
the ends.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from lariat.geometry.obstacles import Obstacle
from lariat.geometry.poses import Pose
from lariat.safety.guard.consent import SignOfLife
from lariat.safety.guard.force_limit import ForceLimit
from lariat.safety.guard.operator_commands import OperatorCommand
from lariat.safety.guard.other_gateways import OtherGateways
from lariat.safety.guard.state_machine import DEVICE_CAUSES, SafetyState
from lariat.safety.guard.watchdog import Watchdog
from lariat.safety.motion.follower import SetpointFollower
from lariat.safety.motion.validation import ChunkRefused
from lariat.scenario import SIDES
from lariat.trajectory import NANOSECONDS
from services.robot_gateway.approach_control import ApproachControl
from services.robot_gateway.arms import UNHEARD_AGE, Arms
from services.robot_gateway.drivers.driver import Driver
from services.robot_gateway.feedback_checks import FeedbackChecks
from services.robot_gateway.operator_control import OperatorControl
from services.robot_gateway.reset_control import ResetControl
from services.robot_gateway.status import CellStatus
from services.robot_gateway.stop_control import StopControl
from services.robot_gateway.trajectory_control import TrajectoryControl, TrajectoryRequest
from services.robot_gateway.writer_control import WriterChunk, WriterControl

LONGEST_STEP = 3.0
"""Longest motion in one tick, in periods of the gateway [-]."""
SETTLE_TIME = 0.3
"""Time after the command's rest within which an arm must have come to rest too [s]."""
READY_TIMEOUT = 30.0
"""Time in which an arm must become ready [s]."""
LAG_FACTOR = 2.0
"""Distance of the command from its chunk above which the cell stops, in step tolerances [-]."""


class Cell:
    """All arms of a cell."""

    def __init__(
        self,
        follower: SetpointFollower,
        drivers: Sequence[Driver],
        starts: Sequence[Pose],
        boot: str,
        arm_automatically: bool = False,
        force_limit: ForceLimit | None = None,
    ) -> None:
        self.follower = follower
        self.arms = Arms(drivers, starts)
        self.arm_automatically = arm_automatically
        self.watchdog = Watchdog()
        self._control = StopControl(follower, boot)
        self._approach = ApproachControl(self.arms, follower, boot)
        limit = force_limit or ForceLimit(np.inf)
        self._feedback_checks = FeedbackChecks(self.arms, follower, limit)
        self._other_gateways = OtherGateways()
        self._trajectory = TrajectoryControl(self.arms, follower)
        self._reset = ResetControl(self.arms, follower)
        self._writers = WriterControl(follower, self._control, self.watchdog, self._listening)
        self._operator = OperatorControl(
            self.arms,
            follower,
            self._control,
            self._writers,
            self._approach,
            self._feedback_checks,
            self._other_gateways,
        )
        self._setpoints_late = False
        """Whether the setpoints are so old that the command brakes."""
        self._moved_at = 0
        """Time at which the command last moved [ns]."""
        self._simulated = not self.arms.reach_hardware
        self._recovery_due = False
        """Whether arms whose feedback was late are made ready as soon as they are heard again."""
        self._pauses = 0
        """Number of pauses that a slow computer has caused."""

    @property
    def safety(self) -> SafetyState:
        """Safety state of the cell."""
        return self._control.safety

    # Inputs

    def take_scene(self, obstacles: Sequence[Obstacle]) -> None:
        """Replace the obstacles of the scene."""
        self.follower.constraints.replace_obstacles(obstacles)

    def take_command(self, command: OperatorCommand, now: int) -> None:
        """Carry out or reject a person's command that arrived at `now` [ns]."""
        self._operator.take(command, now)

    def take_sign_of_life(self, sign: SignOfLife, now: int) -> None:
        """Take a sign of life of the person who lets the arms approach, which came at `now`."""
        self._approach.consent.take(sign, now)

    def take_other_gateway(self, boot: str, now: int) -> None:
        """Stop because another gateway published a state of this cell at `now` [ns]."""
        self._other_gateways.take(boot, now)
        self._control.stop("second_gateway", self._other_gateways.words(now))

    def disarm(self) -> None:
        """Brake and, once at rest, disable the arms, whoever enabled them."""
        self._operator.disarm()

    def take_hold(self, session: str, sequence: int, now: int, reason: str) -> None:
        """Take a writer's message that it holds on purpose."""
        # A controller that has nothing to do holds all the time; approach and trajectory are not
        # its motion.
        if (
            self._writers.take_hold(session, sequence, now)
            and self.safety.may_move
            and not self._approach.active
            and not self._trajectory.running
        ):
            self._control.stop("writer_holds", reason or "the controller holds")

    def take_chunks(self, arrived: Iterable[WriterChunk]) -> None:
        """Take writers' setpoints that arrived since the last tick, the newest ones first."""
        self._writers.take_chunks(arrived)

    def take_trajectory(self, request: TrajectoryRequest, now: int) -> None:
        """Take a trajectory of the joints, a sign of life of its sender, or its cancellation.

        It is executed where a writer's setpoints would be, while the arms stand still.
        """
        trajectory = self._trajectory
        if request.id == trajectory.id:
            trajectory.note_alive(now)
            if request.cancel and trajectory.running:
                trajectory.end("cancelled")
                self._control.stop("writer_holds", "the trajectory was cancelled")
        elif request.points and not request.cancel and not trajectory.running:
            trajectory.start(request, self._obstruction, now)
            if trajectory.running:
                moving = self.safety.moving(True)
                self._control.safety = replace(moving, detail="executing a joint trajectory")

    def take_reset(self, count: int) -> None:
        """Go back to the scenario's start once everything rests; simulation only."""
        self._reset.request(count)

    # Tick

    def step(self, now: int) -> CellStatus:
        """Step the cell at `now` [ns]."""
        self.stop_if_stalled(now)
        self._writers.advance(now)
        elapsed = self.watchdog.elapsed(now)
        self.watchdog.tick(now)
        self._check_consent(now)
        self._check_trajectory(now)
        h = min(elapsed, LONGEST_STEP * self.watchdog.settings.period)
        self._check_following(now, h)
        if h > 0.0:
            self._setpoints_late = self.watchdog.must_brake(now, h)
            rule = self.follower.step(now - round(h / NANOSECONDS), now, self._setpoints_late)
            self._control.rule = rule or self._control.rule
        if not self.follower.resting:
            self._moved_at = now
        elif not self.follower.following:
            self._control.safety = self.safety.moving(False)
            if self._reset.begin() and self.safety.mode != "disarmed":
                self._control.waiting_since = now
        self.arms.exchange(now, self.follower, self._enabled_ends())
        self._reset.finish()
        self._check_feedback(now)
        self._operator.note_change(now)
        return self._status(now)

    def stop_if_stalled(self, now: int) -> None:
        """Stop if the gateway was suspended; called before the messages that waited are handled."""
        moved = self.safety.mode == "moving" or not self.follower.resting
        if not self.watchdog.stalled(now) or not moved:
            return
        if self._control.stalled or self._approach.planned or self._trajectory.planned:
            return
        elapsed = self.watchdog.elapsed(now)
        if self._simulated:
            self._pause(f"the computer was too slow for {elapsed:.2f} s")
        else:
            self._control.stop("stalled", f"the gateway was suspended for {elapsed:.3f} s")
        if self.arms.has_devices:
            self._await_devices(now)
            if self._simulated:
                self.arms.recover()

    def close(self) -> None:
        """End the connections to the arms."""
        self.arms.close()

    def _listening(self) -> bool:
        """Return whether the setpoints of a writer may move the arms."""
        busy = self._control.waiting_since is not None or self._reset.pending
        own = self._approach.running or self._trajectory.running
        return self.safety.may_move and not busy and not own

    @property
    def _obstruction(self) -> str:
        """Why no trajectory may be executed now, in words; empty where one may."""
        if not self.safety.may_move:
            return f"the arms may not move: {self.safety.detail}"
        if self._approach.active or not self._listening():
            return "the arms are not ready yet"
        if self.follower.following or not self.follower.resting:
            return "the arms move; stop the run first"
        return ""

    def _check_following(self, now: int, h: float) -> None:
        """Stop the motion when the setpoints are too old or the command lags too far behind."""
        if not self.follower.following:
            self._approach.running = False
            self._trajectory.end("stopped", self.safety.detail)
            return
        if self._approach.running or self._trajectory.running:
            # No writer refreshes the approach, but the person's consent; a trajectory its sender.
            self.watchdog.feed(now)
        if self.follower.finished(now):
            self.follower.finish()
            self._trajectory.end("reached")
            return
        # Setpoints that would be too old at the next tick stop the motion now.
        if self.watchdog.must_hold(now, h):
            if self.follower.arrived(now):
                self.follower.finish()
            else:
                age = self.watchdog.settings.hold_age
                self._stop_for_silence(f"no fresh setpoints for {1e3 * age:.0f} ms")
            return
        distance, angle = self.follower.lag(now)
        tolerances = self.follower.tolerances
        if distance > LAG_FACTOR * tolerances.step or angle > LAG_FACTOR * tolerances.turn:
            lag = f"{1e3 * distance:.0f} mm and {angle:.2f} rad"
            self._control.stop("left_behind", f"{lag} behind its setpoints")

    def _stop_for_silence(self, silent: str) -> None:
        """Stop because the writer is silent, in words."""
        if self._simulated:
            self._pause(f"the computer was too slow: {silent}")
        else:
            self._control.stop("silence", f"{silent}: controller, bus or network dead or stopped")

    def _pause(self, detail: str) -> None:
        """Stop until the computer keeps up again; simulation only."""
        self._pauses += 1
        self._control.stop("slow", f"{detail} (pause {self._pauses})")

    def _await_devices(self, now: int) -> None:
        """Wait for devices that stop by themselves; the rest of the stop is not sent to them."""
        self._control.waiting_since, self._control.stalled = now, True

    def _check_trajectory(self, now: int) -> None:
        """Stop a trajectory whose sender is silent, and one that an obstacle does not let end."""
        trajectory = self._trajectory
        if trajectory.planned:
            trajectory.planned = False
            trajectory.note_alive(now)
        if not trajectory.running:
            return
        if trajectory.silent(now):
            self._stop_for_silence("the sender of the trajectory is silent")
        elif trajectory.late(now):
            self._control.stop("left_behind", "the trajectory's end is not reached")

    def _check_consent(self, now: int) -> None:
        """Stop the approach when its person lets go."""
        approach = self._approach
        if approach.planned:
            approach.planned = False
            approach.consent.bridge(now)
        if not self.safety.may_move:
            approach.end()
        if approach.active and approach.consent.ended(now):
            approach.end()
            self._control.stop("consent", "the approach was let go; another one goes on")

    def _status(self, now: int) -> CellStatus:
        disarmed, begun = self.safety.mode == "disarmed", self.safety.needs_approach
        away = disarmed and bool(self.arms.ends_away_from_start)
        shown = away or begun or self._approach.active
        distance, angle = self.arms.distance_from_start if shown else (0.0, 0.0)
        return CellStatus(
            safety=self.safety,
            braking=(self._setpoints_late or not self.follower.following)
            and not self.follower.resting,
            rule=self._control.rule,
            refusal=self._writers.refusal,
            sequence=self._writers.sequence,
            refused_sequence=self._writers.refused_sequence,
            command=self._operator.command,
            rejection=self._operator.rejection,
            arms=self.arms.feedback,
            tracking=tuple(self.arms.tracking_errors()),
            reset_count=self._reset.done,
            remarks=self._remarks(now),
            next_session=self._writers.next_session(now),
            needs_approach=away or begun,
            approaching=self._approach.active,
            approach_distance=distance,
            approach_angle=angle,
            pauses=self._pauses,
            trajectory=(self._trajectory.id, self._trajectory.state, self._trajectory.reason),
        )

    def _remarks(self, now: int) -> str:
        """Return what a person should know beside the state, in words."""
        power = self.arms.power_words if self.safety.mode == "disarmed" else ""
        words = (power, self._writers.competing_publishers(now), self._other_gateways.words(now))
        return "; ".join(word for word in words if word and word not in self.safety.detail)

    def _start_approach(self, now: int) -> None:
        try:
            self._approach.start(now)
        except ChunkRefused as refused:
            self._writers.note_refusal(refused)
            self.disarm()
            detail = f"the approach to the start is refused: {refused}"
            self._control.safety = replace(self.safety, detail=detail)
            return
        moving = self.safety.moving(True)
        self._control.safety = replace(moving, detail="approaching the start")

    # Feedback of the arms

    def _check_feedback(self, now: int) -> None:
        """Stop, wait or go on, depending on the feedback of the arms."""
        if self._recovery_due and all(f.fault != "lost_link" for f in self.arms.feedback):
            self._recovery_due = False
            if self.safety.mode == "holding":
                self.arms.recover()
                return
        for name, feedback in zip(SIDES, self.arms.feedback, strict=False):
            if feedback.fault not in DEVICE_CAUSES or self.safety.mode in ("disarmed", "fault"):
                continue
            words = "; ".join(feedback.alarms)
            if self._simulated and feedback.fault == "lost_link":
                if self._control.stalled:
                    continue  # What the emulator sent meanwhile is still to be read.
                if feedback.age > UNHEARD_AGE:  # A socket that closes is noticed earlier.
                    self._pause(f"the computer was too slow: {name}: {words}")
                    self._await_devices(now)
                    self._recovery_due = True
                    continue
            self._control.stop(feedback.fault, f"{name}: {words or feedback.fault}")
            self._control.waiting_since = None
        if self.safety.mode == "disarmed":
            self._finish_disarming(now)
        elif self._control.waiting_since is not None:
            self._finish_waiting(now, self._control.waiting_since)
        elif self.safety.mode != "fault":
            finding = self._feedback_checks.find()
            if finding is None:
                return
            if self._simulated and finding.cause == "tracking" and self.arms.heard_late:
                self._pause(f"the computer was too slow: {finding.detail}")
                self._await_devices(now)
            else:
                self._control.stop(*finding)

    def _finish_disarming(self, now: int) -> None:
        """Disable arms at rest, and arm a simulated cell at boot once they are off."""
        # The arms must rest, not only their command.
        settled = (now - self._moved_at) * NANOSECONDS >= SETTLE_TIME
        may_still_move = self.arms.powered and not settled
        if not self.follower.resting or not (self.arms.standing_still or not may_still_move):
            return
        self.arms.disable()
        self.arms.put_command_to_measured(self.follower)
        self._control.end_waiting()
        at_boot = self.arm_automatically and self.safety.cause == "boot"
        alone = not self._other_gateways.words(now)
        if at_boot and alone and not self.arms.powered and not self.arms.arming_refusal:
            self._operator.arm_at_boot(now)

    def _finish_waiting(self, now: int, since: int) -> None:
        """Continue once the arms are ready; stop when they are not ready in time."""
        if self.arms.ready and self.follower.resting:
            self.arms.put_command_to_measured(self.follower)
            self._control.end_waiting()
            if self._approach.wanted:
                self._start_approach(now)
        elif (now - since) * NANOSECONDS > READY_TIMEOUT:
            self._control.end_waiting()
            self._control.stop(
                "alarm", f"not ready after {READY_TIMEOUT:.0f} s: {self.arms.unready}"
            )

    def _enabled_ends(self) -> list[bool]:
        """Return for each end whether it is sent its commanded pose.

        Braking ends get their pose until they rest, in every mode of the cell. An arm that has
        failed gets none; nor does an arm far from its path, which a pose would make jump back; nor
        any arm after the gateway was suspended.
        """
        if self._control.stalled:
            return [False] * len(self.arms.drivers)
        if self.follower.resting:
            live = (
                self.safety.mode not in ("disarmed", "fault")
                and self._control.waiting_since is None
            )
            return [live and near for near in self.arms.within_tracking_limit(1.0)]
        near = self.arms.within_tracking_limit(2.0)
        return [a and b for a, b in zip(self.arms.fault_free, near, strict=True)]
