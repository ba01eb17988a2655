"""Cell: all arms that hold one rope, stepped with chunks, commands, obstacles and time.

Every tick checks the watchdog, advances the commanded motion or its stop, sends it to the arms and
checks their feedback. All arms stop together, because some rules couple the ends.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from lariat.geometry.obstacles import Obstacle
from lariat.geometry.poses import Pose
from lariat.trajectory import NANOSECONDS, SetpointChunk
from services.robot_gateway.approach_control import ApproachControl
from services.robot_gateway.arms import Arms
from services.robot_gateway.drivers.driver import Driver
from services.robot_gateway.motion.follower import SetpointFollower
from services.robot_gateway.motion.setpoint_sources import SetpointSources
from services.robot_gateway.motion.validation import ChunkRefused, check_length
from services.robot_gateway.reset_control import ResetControl
from services.robot_gateway.safety.consent import SignOfLife
from services.robot_gateway.safety.feedback_checks import FeedbackChecks
from services.robot_gateway.safety.force_limit import ForceLimit
from services.robot_gateway.safety.operator_commands import (
    STOP_ACTIONS,
    CommandRejected,
    OperatorCommand,
    check_command,
)
from services.robot_gateway.safety.other_gateways import OtherGateways
from services.robot_gateway.safety.state_machine import DEVICE_CAUSES, SafetyState
from services.robot_gateway.safety.stop_causes import STOP_CAUSES
from services.robot_gateway.safety.watchdog import Watchdog
from services.robot_gateway.status import CellStatus
from shared.constraints.rule import Rule
from shared.scenario import SIDES


@dataclass(frozen=True)
class CellSettings:
    """Settings of a cell."""

    longest_step: float = 3.0
    """Longest motion in one tick, in periods of the gateway [-]."""
    settle_time: float = 0.3
    """Time after the command's rest within which an arm must have come to rest too [s]."""
    ready_timeout: float = 30.0
    """Time in which an arm must become ready [s]."""
    lag_factor: float = 2.0
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
        settings: CellSettings | None = None,
    ) -> None:
        """Create a cell that is disarmed.

        Args:
            follower: Commanded motion.
            drivers: Drivers of all ends, left first.
            starts: Grip poses of all ends at the scenario's start.
            boot: Id of this start of the gateway.
            arm_automatically: Whether the cell arms itself at boot.
            force_limit: Limit on the contact forces.
            settings: Settings of the cell.
        """
        self.follower = follower
        self.arms = Arms(drivers, starts)
        self.arm_automatically = arm_automatically
        self.settings = settings or CellSettings()
        self.safety = SafetyState(boot)
        self.watchdog = Watchdog()
        self._sources = SetpointSources()
        self._approach = ApproachControl(self.arms, follower, boot)
        limit = force_limit or ForceLimit(np.inf)
        self._feedback_checks = FeedbackChecks(self.arms, follower, limit)
        self._other_gateways = OtherGateways()
        self._shown: tuple[object, ...] = ()
        """What a person must have seen of the state before a command counts."""
        self._changed = 0
        """Time of the first state that shows it [ns]."""
        self._setpoints_late = False
        """Whether the setpoints are so old that the command brakes."""
        self._waiting_since: int | None = None
        """Time since which the cell waits for arms to become ready [ns]."""
        self._stalled = False
        """Whether the gateway was suspended, so that the rest of the motion is not sent."""
        self._moved_at = 0
        """Time at which the command last moved [ns]."""
        self._rule: Rule | None = None
        self._refusal = self._command = self._rejection = ""
        self._sequence = self._refused_sequence = 0
        self._reset = ResetControl(self.arms, follower)

    # Inputs

    def take_scene(self, obstacles: Sequence[Obstacle]) -> None:
        """Replace the obstacles of the scene."""
        self.follower.constraints.replace_obstacles(obstacles)

    def take_command(self, command: OperatorCommand, now: int) -> None:
        """Carry out or reject a person's command that arrived at `now` [ns]."""
        if command.id == self._command and command.action not in STOP_ACTIONS:
            return  # The bus may deliver a command twice.
        self._command, self._rejection = command.id, ""
        try:
            check_command(command, self.safety.boot, now, self._changed)
            match command.action:
                case "disarm":
                    self.disarm()
                case "hold":
                    self._stop("person", "held by a person")
                case "gripper":
                    self._move_gripper(command)
                case "arm":
                    self._arm(command, now)
                case "approach":
                    self._begin_approach(command, now)
                case "acknowledge":
                    self._acknowledge(command, now)
                case "resume":
                    self._resume(now)
        except CommandRejected as rejection:
            self._rejection = str(rejection)
        self._note_change(now)

    def take_sign_of_life(self, sign: SignOfLife, now: int) -> None:
        """Take a sign of life of the person who lets the arms approach, which came at `now`."""
        self._approach.consent.take(sign, now)

    def take_other_gateway(self, boot: str, now: int) -> None:
        """Stop because another gateway published a state of this cell at `now` [ns]."""
        self._other_gateways.take(boot, now)
        self._stop("second_gateway", self._other_gateways.words(now))

    def disarm(self) -> None:
        """Brake and, once at rest, disable the arms, whoever enabled them."""
        self.safety = self.safety.disarmed()
        self.follower.halt()
        self.arms.request_disabling()

    def take_hold(self, session: str, sequence: int, now: int, reason: str) -> None:
        """Take a writer's message that it holds on purpose.

        Args:
            session: Session of the writer.
            sequence: Sequence number within the session.
            now: Time of receipt [ns].
            reason: Reason of the writer, in words.
        """
        try:
            self._admit(session, sequence, now, now)
        except ChunkRefused as refused:
            self._refuse(refused, None)
            return
        self._sources.accept(session, sequence, now)
        self.watchdog.feed(now)
        self._sequence = sequence
        # A controller that has nothing to do holds all the time; the approach is not its motion.
        if self.safety.may_move and not self._approach.active:
            self.safety = self.safety.stopped("writer_holds", reason or "the controller holds")
            self.follower.halt()

    def take_chunk(
        self, chunk: SetpointChunk, session: str, sequence: int, now: int
    ) -> Rule | None:
        """Follow or refuse a writer's setpoints.

        Args:
            chunk: Setpoints of the driven ends.
            session: Session of the writer.
            sequence: Sequence number within the session.
            now: Time of receipt [ns].

        Returns:
            The rule by which they are refused; None where they are followed, or nothing is.
        """
        try:
            offset = self._admit(session, sequence, now, chunk.start)
            if not self.safety.may_move or self._waiting_since is not None:
                return None
            if self._reset.pending or self._approach.running:
                return None
            check_length(chunk, self.follower.tolerances)
            spline = self.follower.check(chunk, now, offset)
        except ChunkRefused as refused:
            # Who is not followed does not report refusals to the writer who is.
            self._refuse(refused, None if refused.rule == "ordered" else sequence)
            if refused.rule not in ("ordered", "fresh"):
                # The writer is alive: the chunk before may run to its resting end.
                self.watchdog.feed(now)
            return refused.rule
        self._sources.accept(session, sequence, now, offset)
        self.watchdog.feed(now)
        self._sequence = sequence
        self.follower.follow(spline, now)
        self.safety = self.safety.moving(True)
        return None

    def take_reset(self, count: int) -> None:
        """Go back to the scenario's start once everything rests; simulation only.

        Args:
            count: The controller's count of resets.
        """
        self._reset.request(count)

    # Tick

    def step(self, now: int) -> CellStatus:
        """Step the cell at `now` [ns]."""
        self.stop_if_stalled(now)
        elapsed = self.watchdog.elapsed(now)
        self.watchdog.tick(now)
        self._check_consent(now)
        h = min(elapsed, self.settings.longest_step * self.watchdog.settings.period)
        self._check_following(now, h)
        if h > 0.0:
            self._setpoints_late = self.watchdog.must_brake(now, h)
            rule = self.follower.step(now - round(h / NANOSECONDS), now, self._setpoints_late)
            self._rule = rule or self._rule
        if not self.follower.resting:
            self._moved_at = now
        elif not self.follower.following:
            self.safety = self.safety.moving(False)
            if self._reset.begin() and self.safety.mode != "disarmed":
                self._waiting_since = now
        self.arms.exchange(now, self.follower, self._enabled_ends())
        self._reset.finish()
        self._check_feedback(now)
        self._note_change(now)
        return self._status(now)

    def stop_if_stalled(self, now: int) -> None:
        """Stop if the gateway was suspended; called before the messages that waited are handled."""
        moved = self.safety.mode == "moving" or not self.follower.resting
        if not self.watchdog.stalled(now) or not moved:
            return
        if self._stalled or self._approach.planned:
            return
        elapsed = self.watchdog.elapsed(now)
        self._stop("stalled", f"the gateway was suspended for {elapsed:.3f} s")
        if self.arms.has_devices:
            # Devices have stopped by themselves; the rest of the commanded stop is not sent.
            self._waiting_since, self._stalled = now, True

    def close(self) -> None:
        """End the connections to the arms."""
        self.arms.close()

    def _check_following(self, now: int, h: float) -> None:
        """Stop the motion when the setpoints are too old or the command lags too far behind."""
        if not self.follower.following:
            self._approach.running = False
            return
        if self._approach.running:
            # No writer refreshes the approach, but the person's consent.
            self.watchdog.feed(now)
        if self.follower.finished(now):
            self.follower.halt()
            return
        # Setpoints that would be too old at the next tick stop the motion now.
        if self.watchdog.must_hold(now, h):
            if self.follower.arrived(now):
                self.follower.halt()
            else:
                age = self.watchdog.settings.hold_age
                silent = f"no fresh setpoints for {1e3 * age:.0f} ms"
                self._stop("silence", f"{silent}: controller, bus or network dead or stopped")
            return
        distance, angle = self.follower.lag(now)
        tolerances, factor = self.follower.tolerances, self.settings.lag_factor
        if distance > factor * tolerances.step or angle > factor * tolerances.turn:
            lag = f"{1e3 * distance:.0f} mm and {angle:.2f} rad"
            self._stop("left_behind", f"{lag} behind its setpoints")

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
            self._stop("consent", "the approach was let go; another one goes on")

    def _stop(self, cause: str, detail: str, rule: Rule | None = None) -> None:
        self.safety = self.safety.stopped(cause, detail)
        self._rule = rule or STOP_CAUSES[cause].rule or self._rule
        self.follower.halt()

    def _note_change(self, now: int) -> None:
        """Note the time from which on a person sees what they must know before a command."""
        safety = self.safety
        shown = () if safety.may_move else (safety.mode, safety.cause, safety.next_session)
        if shown != self._shown:
            self._shown, self._changed = shown, now

    def _status(self, now: int) -> CellStatus:
        disarmed, begun = self.safety.mode == "disarmed", self.safety.needs_approach
        away = disarmed and bool(self.arms.ends_away_from_start)
        shown = away or begun or self._approach.active
        distance, angle = self.arms.distance_from_start if shown else (0.0, 0.0)
        return CellStatus(
            safety=self.safety,
            braking=(self._setpoints_late or not self.follower.following)
            and not self.follower.resting,
            rule=self._rule,
            refusal=self._refusal,
            sequence=self._sequence,
            refused_sequence=self._refused_sequence,
            command=self._command,
            rejection=self._rejection,
            arms=self.arms.feedback,
            tracking=tuple(self.arms.tracking_errors()),
            reset_count=self._reset.done,
            remarks=self._remarks(now),
            next_session=self._next_session(now),
            needs_approach=away or begun,
            approaching=self._approach.active,
            approach_distance=distance,
            approach_angle=angle,
        )

    # Writers

    def _admit(self, session: str, sequence: int, now: int, start: int) -> int:
        """Return the offset from a writer's clock to the gateway's [ns].

        Raises:
            ChunkRefused: The writer is not the one that is followed, or its message is old.
        """
        before = self.safety.cause
        self.safety, answer = self._sources.admit(self.safety, session, sequence, now, start)
        if self.safety.cause == "new_writer" and before != "new_writer":
            self.follower.halt()
        if isinstance(answer, ChunkRefused):
            raise answer
        return answer

    def _refuse(self, refused: ChunkRefused, sequence: int | None) -> None:
        self._rule, self._refusal = refused.rule, str(refused)
        self._refused_sequence = self._refused_sequence if sequence is None else sequence

    def _next_session(self, now: int) -> str:
        """Return the session of the writer that arming or an acknowledgement would accept."""
        if self.safety.mode != "disarmed":
            return self.safety.next_session
        writers = self._sources.writers(now)
        return writers[0] if len(writers) == 1 else ""

    def _remarks(self, now: int) -> str:
        """Return what a person should know beside the state, in words."""
        power = self.arms.power_words if self.safety.mode == "disarmed" else ""
        words = (power, self._sources.rivals(now), self._other_gateways.words(now))
        return "; ".join(word for word in words if word and word not in self.safety.detail)

    # Commands of a person

    def _arm(self, command: OperatorCommand, now: int) -> None:
        if self.safety.mode == "disarmed":
            self._check_permission(command, now)
            _reject_for(self.arms.arming_refusal or self._approach.arming_refusal)
        self.safety = self.safety.armed(command.session)
        self._enable(now)

    def _begin_approach(self, command: OperatorCommand, now: int) -> None:
        if self.safety.mode == "disarmed" or self.safety.needs_approach:
            self._check_permission(command, now)
            _reject_for(self.arms.arming_refusal)
        safety = self.safety.approaching(command.session)
        if not self.follower.resting:
            raise CommandRejected("the arms have not come to rest yet; try again")
        self._approach.request(command, now)
        self.safety = safety
        self._enable(now)

    def _acknowledge(self, command: OperatorCommand, now: int) -> None:
        safety = self.safety.acknowledged()
        self._check_permission(command, now)
        self.safety = safety
        self._feedback_checks.acknowledge()
        self._wait_for_arms(now)
        self.arms.recover()

    def _resume(self, now: int) -> None:
        safety = self.safety.resumed()
        _reject_for(self._other_gateways.words(now))
        if self._waiting_since is not None:
            raise CommandRejected(f"the arms are not ready yet ({self.arms.unready}); try again")
        self.safety = safety

    def _check_permission(self, command: OperatorCommand, now: int) -> None:
        """Check that a person permits motion to one gateway and the writer that they name.

        Raises:
            CommandRejected: Another gateway speaks, or another writer than the one that is named.
        """
        _reject_for(self._other_gateways.words(now))
        session = self._next_session(now)
        if self.safety.mode == "disarmed":
            _reject_for(self._sources.rivals(now))
        if command.session != session:
            raise CommandRejected(
                f"names the writer {command.session!r}, but it is {session!r}; look again"
            )

    def _arm_at_boot(self, now: int) -> None:
        """Arm a simulated cell without a person; its arms are put where the scenario begins."""
        self.arms.place_at_start(self.arms.ends_away_from_start)
        self.safety = replace(self.safety.armed(), detail="armed by the scenario")
        self._enable(now)

    def _enable(self, now: int) -> None:
        self._wait_for_arms(now)
        self.arms.enable()

    def _wait_for_arms(self, now: int) -> None:
        self._waiting_since = now
        self._rule, self._refusal = None, ""

    def _move_gripper(self, command: OperatorCommand) -> None:
        if not self.follower.resting:
            raise CommandRejected("a gripper opens and closes only while the arms rest; hold first")
        self.arms.move_gripper(command)

    def _start_approach(self, now: int) -> None:
        try:
            self._approach.start(now)
        except ChunkRefused as refused:
            self._refuse(refused, None)
            self.disarm()
            detail = f"the approach to the start is refused: {refused}"
            self.safety = replace(self.safety, detail=detail)
            return
        self.safety = replace(self.safety.moving(True), detail="approaching the start")

    # Feedback of the arms

    def _check_feedback(self, now: int) -> None:
        """Stop, wait or go on, depending on the feedback of the arms."""
        for name, feedback in zip(SIDES, self.arms.feedback, strict=False):
            if feedback.fault not in DEVICE_CAUSES or self.safety.mode in ("disarmed", "fault"):
                continue
            words = "; ".join(feedback.alarms)
            self._stop(feedback.fault, f"{name}: {words or feedback.fault}")
            self._waiting_since = None
        if self.safety.mode == "disarmed":
            self._finish_disarming(now)
        elif self._waiting_since is not None:
            self._finish_waiting(now, self._waiting_since)
        elif self.safety.mode != "fault":
            finding = self._feedback_checks.find()
            if finding is not None:
                self._stop(*finding)

    def _finish_disarming(self, now: int) -> None:
        """Disable arms at rest, and arm a simulated cell at boot once they are off."""
        # The arms must rest, not only their command.
        settled = (now - self._moved_at) * NANOSECONDS >= self.settings.settle_time
        may_still_move = self.arms.powered and not settled
        if not self.follower.resting or not (self.arms.standing_still or not may_still_move):
            return
        self._waiting_since = None
        self.arms.disable()
        self.arms.put_command_to_measured(self.follower)
        self._stalled = False
        at_boot = self.arm_automatically and self.safety.cause == "boot"
        alone = not self._other_gateways.words(now)
        if at_boot and alone and not self.arms.powered and not self.arms.arming_refusal:
            self._arm_at_boot(now)

    def _finish_waiting(self, now: int, since: int) -> None:
        """Continue once the arms are ready; stop when they are not ready in time."""
        timeout = self.settings.ready_timeout
        if self.arms.ready and self.follower.resting:
            self.arms.put_command_to_measured(self.follower)
            self._waiting_since, self._stalled = None, False
            if self._approach.wanted:
                self._start_approach(now)
        elif (now - since) * NANOSECONDS > timeout:
            self._waiting_since, self._stalled = None, False
            self._stop("alarm", f"not ready after {timeout:.0f} s: {self.arms.unready}")

    def _enabled_ends(self) -> list[bool]:
        """Return for each end whether it is sent its commanded pose.

        Braking ends get their pose until they rest, in every mode of the cell. An arm that has
        failed gets none; nor does an arm far from its path, which a pose would make jump back; nor
        any arm after the gateway was suspended.
        """
        if self._stalled:
            return [False] * len(self.arms.drivers)
        if self.follower.resting:
            live = self.safety.mode not in ("disarmed", "fault") and self._waiting_since is None
            return [live and near for near in self.arms.within_tracking_limit(1.0)]
        near = self.arms.within_tracking_limit(2.0)
        return [a and b for a, b in zip(self.arms.fault_free, near, strict=True)]


def _reject_for(reason: str) -> None:
    """Reject a command for a reason, if there is one.

    Raises:
        CommandRejected: There is one.
    """
    if reason:
        raise CommandRejected(reason)
