"""Driver of any arm that follows joint angles: a `lariat.protocols.Arm`, guarded.

Commanded poses of the grip become joint angles by the kinematics of the arm's URDF, which also
serve the gateway's joint rules. An arm that raises or reports nonsense is at fault and named.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float64

from lariat.arms.kinematics import UrdfKinematics
from lariat.geometry.poses import Pose
from lariat.protocols.arm import Arm, ArmReading
from lariat.safety.constraints.joints import JointConstraints
from lariat.scenario.extensions import Extension, ExtensionFault
from lariat.scenario.sections import Limits
from lariat.trajectory import NANOSECONDS
from services.robot_gateway.drivers.driver import ArmFeedback

FIRST_POINT_DISTANCE = 0.005
"""Largest distance of the first servo point from the arm [m]."""
JOINT_STEP_LIMIT = 0.12
"""Largest change of a joint between two servo points [rad]."""
PLACEMENT_TOLERANCE = 0.002
"""Distance at which a simulated arm counts as placed [m]."""
TRACKING_ANGLE_LIMIT = 0.15
"""Angle between grip and path above which the arm is at fault [rad]."""
PERIOD_TOLERANCE = 1_000_000
"""Time by which a tick may be early for a servo point [ns]."""


class JointArmDriver:
    """One arm with a gripper at its flange."""

    moves = True
    tracking_angle_limit = TRACKING_ANGLE_LIMIT

    def __init__(
        self,
        name: str,
        arm: Arm,
        extension: Extension,
        kinematics: UrdfKinematics,
        limits: Limits,
    ) -> None:
        """Create the driver of an arm; `extension` is its class, for faults."""
        facts = arm.facts
        self._arm, self._extension, self._kinematics = arm, extension, kinematics
        self.name = name
        self.live = self.reaches_hardware = not facts.simulated
        self.tracking_limit = facts.tracking_limit
        self._period = round(1.0 / facts.rate / NANOSECONDS)
        self._max_joint_step = JOINT_STEP_LIMIT * max(1.0, 125.0 / facts.rate)
        self.joint_constraints: JointConstraints | None = JointConstraints(kinematics, limits)
        self._reading = ArmReading(None)
        self._velocities = np.zeros(kinematics.joint_count)
        self._stepped: int | None = None
        self._target: np.ndarray | None = None
        """Joint angles that were commanded last, while the arm follows [rad]."""
        self._placement: Pose | None = None
        self._enabled = False
        """Whether the arm has been told to become ready, and not to stop since."""
        self._force_at_rest: np.ndarray | None = None
        self._fault = ""
        """Fault of the class itself, until it is enabled again."""

    def enable(self) -> None:
        self._enabled, self._fault, self._force_at_rest = True, "", None
        self._call("enable")

    def disable(self) -> None:
        self._enabled = False
        self._call("disable")

    def recover(self) -> None:
        self._fault, self._target = "", None
        if not self._reading.ready:
            self.enable()

    def set_gripper(self, close: bool) -> None:
        self._call("set_gripper", close)

    def close(self) -> None:
        self._call("close")

    def place(self, pose: Pose) -> bool:
        place = getattr(self._arm, "place", None)
        joints = self._kinematics.solve_anywhere(pose)
        if place is None or joints is None:
            return False
        self._placement, self._target, self._stepped = pose, None, None
        self._call("place", joints)
        return True

    def step(
        self, now: int, target: Pose | None, velocity: Float64[np.ndarray, "2 3"]
    ) -> ArmFeedback:
        del velocity
        due = self._stepped is None or now - self._stepped >= self._period - PERIOD_TOLERANCE
        if due:
            self._exchange(now, self._wanted(target))
        return self._feedback()

    def _wanted(self, target: Pose | None) -> Float64[np.ndarray, "j"] | None:
        """Joint angles for a commanded pose; None when the arm must not move."""
        measured = self._reading.joints
        if target is None or not self._reading.ready or measured is None or self._fault:
            self._target = None
            if measured is not None:
                # Where it begins to move is the posture that it keeps.
                self._kinematics.posture = np.array(measured, dtype=float)
            return None
        near = measured if self._target is None else self._target
        if self._target is None:
            distance = np.linalg.norm(self._kinematics.grip(measured).position - target.position)
            if distance > FIRST_POINT_DISTANCE:
                return None
        joints = self._kinematics.solve(target, near)
        if joints is None or np.max(np.abs(joints - near)) > self._max_joint_step:
            # Constraints keep the command away from here; a deviating arm is a tracking fault.
            return self._target
        self._target = joints
        return joints

    def _exchange(self, now: int, target: Float64[np.ndarray, "j"] | None) -> None:
        """Step the arm and take its reading."""
        before, elapsed = self._reading.joints, (now - (self._stepped or now)) * NANOSECONDS
        self._stepped = now
        try:
            with self._extension.guarded("step"):
                reading = self._arm.step(now * NANOSECONDS, target)
                joints, velocities = reading.joints, reading.velocities
            shape = (self._kinematics.joint_count,)
            if joints is not None:
                joints = self._extension.checked("step", joints, shape)
            if velocities is not None:
                self._velocities = self._extension.checked("step", velocities, shape)
            elif joints is not None and before is not None and elapsed > 0.0:
                self._velocities = (joints - before) / elapsed
            if reading.force is not None:
                self._extension.checked("step", reading.force, (3,))
        except ExtensionFault as fault:
            self._fault = str(fault)
            return
        self._reading = reading
        if self._enabled and self._force_at_rest is None and reading.ready:
            self._force_at_rest = None if reading.force is None else np.array(reading.force)

    def _call(self, method: str, *arguments: object) -> None:
        try:
            with self._extension.guarded(method):
                getattr(self._arm, method)(*arguments)
        except ExtensionFault as fault:
            self._fault = str(fault)

    def _feedback(self) -> ArmFeedback:
        reading, joints = self._reading, self._reading.joints
        pose, velocity, wrench = None, np.zeros((2, 3)), None
        if joints is not None:
            pose = self._kinematics.grip(joints)
            twist = self._kinematics.jacobian(joints) @ self._velocities
            flange = self._kinematics.flange(joints)
            velocity = self._kinematics.grip_velocity(twist.reshape(2, 3), flange)
            if reading.force is not None:
                wrench = np.array([reading.force, np.full(3, np.nan)])
                wrench = self._kinematics.grip_wrench(wrench, flange)
        self._check_placed(pose)
        fault, alarms = "", tuple(reading.faults)
        if self._fault:
            fault, alarms = "alarm", (self._fault, *alarms)
        elif not reading.connected:
            fault, alarms = "lost_link", alarms or ("the arm does not answer",)
        elif reading.faults:
            fault = "alarm"
        return ArmFeedback(
            pose=pose,
            velocity=velocity,
            ready=reading.ready and not fault and self._placement is None,
            fault=fault if self._enabled else "",
            alarms=alarms,
            joints=() if joints is None else tuple(np.asarray(joints, float).tolist()),
            gripper_closed=reading.gripper_closed,
            mode=reading.mode,
            contact_force=self._contact_force,
            wrench=wrench,
            powered=reading.powered,
        )

    @property
    def _contact_force(self) -> float:
        """Change of the force since the arm became ready [N]; 0 without a sensor."""
        if self._force_at_rest is None or self._reading.force is None:
            return 0.0
        return float(np.linalg.norm(np.asarray(self._reading.force) - self._force_at_rest))

    def _check_placed(self, measured: Pose | None) -> None:
        if self._placement is not None and measured is not None:
            gap = np.linalg.norm(measured.position - self._placement.position)
            self._placement = None if gap < PLACEMENT_TOLERANCE else self._placement
