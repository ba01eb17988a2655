"""Arms of a cell: exchange of commands and feedback with all drivers."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from lariat.geometry.poses import Pose, pose_difference
from lariat.safety.guard.operator_commands import CommandRejected, OperatorCommand
from lariat.safety.motion.approach import is_away
from lariat.safety.motion.command_history import CommandHistory
from lariat.safety.motion.follower import SetpointFollower
from lariat.scenario import SIDES
from services.robot_gateway.drivers.driver import ArmFeedback, Driver

UNHEARD_AGE = 0.1
"""Age of its feedback above which nothing is known of the power of an arm [s]."""
LATE_GAP = 0.04
"""Time without feedback, of every 8 ms, above which computer or line were late [s]."""
STANDSTILL_SPEED = (0.01, 0.05)
"""Linear and angular speed of a gripper below which its arm stands still [m/s, rad/s]."""


class Arms:
    """Drivers of all ends, left first."""

    def __init__(self, drivers: Sequence[Driver], starts: Sequence[Pose]) -> None:
        self.drivers = tuple(drivers)
        self.starts = tuple(starts)
        self.grips = list(starts)
        """Grip poses of all ends, as measured when the command was last set to them."""
        self.feedback: tuple[ArmFeedback, ...] = ()
        self._history = CommandHistory()
        self._tracking_errors: list[tuple[float, float]] | None = None
        """Cached until the next exchange."""
        self._to_disable = [True] * len(self.drivers)
        """Whether the power of each end must be taken while the cell is disarmed."""

    def exchange(self, now: int, follower: SetpointFollower, enabled: Sequence[bool]) -> None:
        """Send enabled ends their commanded poses, and take the feedback of all."""
        rows = []
        driven = iter(follower.grips())
        for driver, sent in zip(self.drivers, enabled, strict=True):
            pose, twist = next(driven) if driver.moves else (None, np.zeros((2, 3)))
            rows.append(driver.step(now, pose if sent else None, twist))
        self.feedback = tuple(rows)
        self._history.add(now, follower.state)
        self._tracking_errors = None
        for k, feedback in enumerate(rows):
            # Nobody knows who has enabled an arm meanwhile.
            self._to_disable[k] |= feedback.powered and feedback.age > UNHEARD_AGE

    def put_command_to_measured(self, follower: SetpointFollower) -> None:
        """Set the command to the measured poses, at rest."""
        for k, feedback in enumerate(self.feedback):
            if feedback.pose is not None:
                self.grips[k] = feedback.pose
            joints = self.drivers[k].joint_constraints
            if joints is not None and feedback.joints:
                joints.set_joints(feedback.joints)
        follower.place(self.grips)
        self._history.clear()
        self._tracking_errors = None

    # Commands to the devices

    def enable(self) -> None:
        """Begin to make the arms ready to follow; takes several ticks."""
        self._to_disable = [False] * len(self.drivers)
        for driver in self.drivers:
            driver.enable()

    def recover(self) -> None:
        """Begin to clear the faults of the arms; takes several ticks."""
        self._to_disable = [False] * len(self.drivers)
        for driver in self.drivers:
            driver.recover()

    def request_disabling(self) -> None:
        """Let `disable` take the power of every arm, whoever gave it."""
        self._to_disable = [True] * len(self.drivers)

    def disable(self) -> None:
        """Take the power of the arms for which it was requested; called until it is off.

        Power that somebody else gives a disarmed arm later, for example at its pendant, is only
        reported.
        """
        for k, feedback in enumerate(self.feedback):
            self._to_disable[k] &= feedback.powered
            if self._to_disable[k]:
                self.drivers[k].disable()

    def close(self) -> None:
        """End the connections to the arms."""
        for driver in self.drivers:
            driver.close()

    def place_at_start(self, ends: Sequence[int]) -> None:
        """Put some ends at the scenario's start; simulation only."""
        for k in ends:
            if self.drivers[k].place(self.starts[k]):
                self.grips[k] = self.starts[k]

    def move_gripper(self, command: OperatorCommand) -> None:
        """Open or close a gripper."""
        if command.arm not in SIDES:
            raise CommandRejected(f"there is no arm {command.arm!r}; there are {', '.join(SIDES)}")
        driver = self.drivers[SIDES.index(command.arm)]
        if not driver.moves:
            raise CommandRejected(f"{command.arm} is fixed and has no gripper")
        driver.set_gripper(command.close)

    # State of the devices

    @property
    def reach_hardware(self) -> bool:
        """Whether any driver can reach hardware."""
        return any(driver.reaches_hardware for driver in self.drivers)

    @property
    def has_devices(self) -> bool:
        """Whether any end is a device, which deviates from its command."""
        return any(d.moves and np.isfinite(d.tracking_limit) for d in self.drivers)

    @property
    def standing_still(self) -> bool:
        """Whether no arm moves; arms follow their command with a delay."""
        speeds = [np.linalg.norm(f.velocity, axis=-1) for f in self.feedback]
        return all(bool(np.all(speed < STANDSTILL_SPEED)) for speed in speeds)

    @property
    def fault_free(self) -> list[bool]:
        """Whether each end reports no fault."""
        faults = [feedback.fault for feedback in self.feedback] or [""] * len(self.drivers)
        return [not fault for fault in faults]

    @property
    def ready(self) -> bool:
        """Whether all ends can follow and their poses are known."""
        return all(f.ready and f.pose is not None for f in self.feedback)

    @property
    def contact_forces(self) -> list[float]:
        """Change of the force at every gripper since it was armed at rest [N]."""
        return [feedback.contact_force for feedback in self.feedback]

    @property
    def ends_away_from_start(self) -> list[int]:
        """Indices of the driven ends that are not at the scenario's start."""
        return [
            k
            for k, driver in enumerate(self.drivers)
            if driver.moves and is_away(self.grips[k], self.starts[k])
        ]

    @property
    def at_start(self) -> bool:
        """Whether all driven ends report the scenario's start as their pose."""
        return not any(
            driver.moves and (feedback.pose is None or is_away(feedback.pose, start))
            for driver, feedback, start in zip(
                self.drivers, self.feedback, self.starts, strict=True
            )
        )

    @property
    def distance_from_start(self) -> tuple[float, float]:
        """Largest distance and angle of a driven end from the scenario's start [m, rad]."""
        rows = [
            self.distance_from_start_of(k) for k, driver in enumerate(self.drivers) if driver.moves
        ]
        return (max(d for d, _ in rows), max(a for _, a in rows)) if rows else (0.0, 0.0)

    def distance_from_start_of(self, end: int) -> tuple[float, float]:
        """Return distance and angle of one end from the scenario's start [m, rad]."""
        pose = self.feedback[end].pose if self.feedback else None
        return pose_difference(pose or self.grips[end], self.starts[end])

    @property
    def heard_late(self) -> bool:
        """Whether the feedback of an arm had a gap within the last second."""
        return any(feedback.link_gap > LATE_GAP for feedback in self.feedback)

    @property
    def powered(self) -> bool:
        """Whether any arm may have power."""
        return any(feedback.powered for feedback in self.feedback)

    @property
    def power_words(self) -> str:
        """Which arms still have power, in words; empty where all are off."""
        words = [
            f"{name}, not heard" if feedback.age > UNHEARD_AGE else name
            for name, feedback in zip(SIDES, self.feedback, strict=False)
            if feedback.powered
        ]
        return f"still powered: {', '.join(words)}" if words else ""

    @property
    def arming_refusal(self) -> str:
        """Reason why the arms cannot be armed, in words; empty where there is none."""
        for name, feedback in zip(SIDES, self.feedback, strict=False):
            words = "; ".join(feedback.alarms)
            if feedback.fault:
                return f"{name}: {words or feedback.fault}"
            if feedback.pose is None:
                return f"{name}: {words or 'its pose is not known yet'}"
        return "" if self.feedback else "there is no feedback of the arms yet"

    @property
    def unready(self) -> str:
        """Names of the arms that are not ready, with their reasons."""
        return ", ".join(
            f"{name}: {'; '.join(feedback.alarms) or 'not ready'}"
            for name, feedback in zip(SIDES, self.feedback, strict=False)
            if not feedback.ready
        )

    def within_tracking_limit(self, factor: float) -> list[bool]:
        """Return whether each end is within `factor` tracking limits of its path."""
        if not self.feedback:
            return [True] * len(self.drivers)
        return [
            distance <= factor * driver.tracking_limit
            and angle <= factor * driver.tracking_angle_limit
            for driver, (distance, angle) in zip(self.drivers, self.tracking_errors(), strict=True)
        ]

    def tracking_errors(self) -> list[tuple[float, float]]:
        """Return distance and angle of every arm from its path [m, rad].

        An arm follows its command with a delay; what counts is the nearest pose commanded lately.
        """
        if self._tracking_errors is None:
            self._tracking_errors = self._compute_tracking_errors()
        return self._tracking_errors

    def _compute_tracking_errors(self) -> list[tuple[float, float]]:
        rows = []
        driven = -1
        for driver, feedback in zip(self.drivers, self.feedback, strict=True):
            driven += driver.moves
            device = driver.moves and np.isfinite(driver.tracking_limit)
            comparable = device and feedback.pose is not None
            rows.append(self._history.error(driven, feedback.pose) if comparable else (0.0, 0.0))
        return rows
