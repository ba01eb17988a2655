"""Control by a person: commands, the conditions under which they count, and their answers."""

from __future__ import annotations

from dataclasses import replace

from lariat.safety.guard.operator_commands import (
    STOP_ACTIONS,
    CommandRejected,
    OperatorCommand,
    check_command,
)
from lariat.safety.guard.other_gateways import OtherGateways
from lariat.safety.motion.follower import SetpointFollower
from services.robot_gateway.approach_control import ApproachControl
from services.robot_gateway.arms import Arms
from services.robot_gateway.feedback_checks import FeedbackChecks
from services.robot_gateway.stop_control import StopControl
from services.robot_gateway.writer_control import WriterControl


class OperatorControl:
    """Commands of persons to one cell."""

    def __init__(
        self,
        arms: Arms,
        follower: SetpointFollower,
        control: StopControl,
        writers: WriterControl,
        approach: ApproachControl,
        feedback_checks: FeedbackChecks,
        other_gateways: OtherGateways,
    ) -> None:
        self._arms = arms
        self._follower = follower
        self._control = control
        self._writers = writers
        self._approach = approach
        self._feedback_checks = feedback_checks
        self._other_gateways = other_gateways
        self._shown: tuple[object, ...] = ()
        """What a person must have seen of the state before a command counts."""
        self._changed = 0
        """Time of the first state that shows it [ns]."""
        self.command = ""
        """Id of the command that was handled last."""
        self.rejection = ""
        """Reason why it was not carried out; empty if it was."""

    def take(self, command: OperatorCommand, now: int) -> None:
        """Carry out or reject a command that arrived at `now` [ns]."""
        if command.id == self.command and command.action not in STOP_ACTIONS:
            return  # The bus may deliver a command twice.
        self.command, self.rejection = command.id, ""
        try:
            check_command(command, self._control.safety.boot, now, self._changed)
            match command.action:
                case "disarm":
                    self.disarm()
                case "hold":
                    self._control.stop("person", f"held by {command.origin}")
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
            self.rejection = str(rejection)
        self.note_change(now)

    def disarm(self) -> None:
        """Brake and, once at rest, disable the arms, whoever enabled them."""
        self._control.safety = self._control.safety.disarmed()
        self._follower.halt()
        self._arms.request_disabling()

    def arm_at_boot(self, now: int) -> None:
        """Arm a simulated cell without a person; its arms are put where the scenario begins."""
        self._arms.place_at_start(self._arms.ends_away_from_start)
        self._control.safety = replace(self._control.safety.armed(), detail="armed by the scenario")
        self._enable(now)

    def note_change(self, now: int) -> None:
        """Note the time from which on a person sees what they must know before a command."""
        safety = self._control.safety
        shown = () if safety.may_move else (safety.mode, safety.cause, safety.next_session)
        if shown != self._shown:
            self._shown, self._changed = shown, now

    def _arm(self, command: OperatorCommand, now: int) -> None:
        if self._control.safety.mode == "disarmed":
            self._check_permission(command, now)
            _reject_for(self._arms.arming_refusal or self._approach.arming_refusal)
        self._control.safety = self._control.safety.armed(command.session)
        self._enable(now)

    def _begin_approach(self, command: OperatorCommand, now: int) -> None:
        if self._control.safety.mode == "disarmed" or self._control.safety.needs_approach:
            self._check_permission(command, now)
            _reject_for(self._arms.arming_refusal)
        safety = self._control.safety.approaching(command.session)
        if not self._follower.resting:
            raise CommandRejected("the arms have not come to rest yet; try again")
        self._approach.request(command, now)
        self._control.safety = safety
        self._enable(now)

    def _acknowledge(self, command: OperatorCommand, now: int) -> None:
        safety = self._control.safety.acknowledged()
        self._check_permission(command, now)
        self._control.safety = safety
        self._feedback_checks.acknowledge()
        self._wait_for_arms(now)
        self._arms.recover()

    def _resume(self, now: int) -> None:
        safety = self._control.safety.resumed()
        _reject_for(self._other_gateways.words(now))
        if self._control.waiting_since is not None:
            raise CommandRejected(f"the arms are not ready yet ({self._arms.unready}); try again")
        self._control.safety = safety

    def _move_gripper(self, command: OperatorCommand) -> None:
        if not self._follower.resting:
            raise CommandRejected("a gripper opens and closes only while the arms rest; hold first")
        self._arms.move_gripper(command)

    def _check_permission(self, command: OperatorCommand, now: int) -> None:
        """Check that a person permits motion to one gateway and the writer that they name."""
        _reject_for(self._other_gateways.words(now))
        session = self._writers.next_session(now)
        if self._control.safety.mode == "disarmed":
            _reject_for(self._writers.competing_publishers(now))
        if command.session != session:
            raise CommandRejected(
                f"names the writer {command.session!r}, but it is {session!r}; look again"
            )

    def _enable(self, now: int) -> None:
        self._wait_for_arms(now)
        self._arms.enable()

    def _wait_for_arms(self, now: int) -> None:
        self._control.wait_for_arms(now)
        self._writers.forget_refusal()


def _reject_for(reason: str) -> None:
    """Reject a command for a reason, if there is one."""
    if reason:
        raise CommandRejected(reason)
