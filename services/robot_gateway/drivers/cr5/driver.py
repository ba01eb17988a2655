"""Driver of a CR5 that follows servo points: real, or emulated.

V4 is sent poses. ServoP of V3 accepts no duration and lags by a tenth of a second, so V3 is sent
joint angles where its firmware accepts a duration for them. These are solved with the nominal
geometry and corrected for the arm's own: the feedback states joint angles and flange pose of the
same instant, and the deviation of that pose from the nominal one changes slowly along a path.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float64

from lariat.arms.cr5_kinematics import Kinematics
from lariat.geometry.poses import Pose
from lariat.safety.constraints.joints import JointConstraints
from lariat.scenario.sections import Limits
from services.robot_gateway.drivers.cr5.client import Cr5Client
from services.robot_gateway.drivers.cr5.contact_force import ContactForce
from services.robot_gateway.drivers.cr5.link import Link
from services.robot_gateway.drivers.cr5.link_quality import LinkQuality
from services.robot_gateway.drivers.cr5.power_sequences import EnableSettings
from services.robot_gateway.drivers.driver import ArmFeedback
from shared.cr5 import pose_vectors
from shared.cr5.alarms import FOLLOWING_MODES

SERVO_POINT_INTERVAL = 28_000_000
"""Least time between servo points [ns]: with ticks of 8 ms they come every 32 ms, just above the
30 ms that the vendor recommends, and a tick that is 4 ms late delays none. Points are sent at rest
too, as an arm may take their absence for a fault."""
SERVO_POINT_TIME = 0.04
"""Time in which a point is to be reached [s]: slightly longer than the time between points."""
PLACEMENT_TOLERANCE = 0.004
"""Distance at which an emulated arm counts as placed [m]: its geometry may be calibrated."""
JOINT_STEP_LIMIT = 0.12
"""Largest change of a joint between two points [rad]: a larger one trips the drives of V3."""
FIRST_POINT_DISTANCE = 0.005
"""Largest distance of the first point from the arm [m]."""


class Cr5Driver:
    """One CR5 with a gripper at its flange."""

    name = "cr5"
    moves = True
    tracking_limit = 0.02
    tracking_angle_limit = 0.15

    def __init__(
        self,
        link: Link,
        kinematics: Kinematics,
        limits: Limits,
        emulated: bool,
        tool_output: int = 1,
        settings: EnableSettings | None = None,
    ) -> None:
        """Create the driver; the connection is opened by the first steps.

        `emulated`: whether the arm can be placed at a pose; `tool_output` closes the gripper.
        """
        self._emulated, self.reaches_hardware = emulated, not emulated
        self.joint_constraints: JointConstraints | None = JointConstraints(kinematics, limits)
        self._kinematics = kinematics
        self._client = Cr5Client(link, settings)
        self._tool_output = tool_output
        self._closed = True
        self._enable_requested = False
        self._point_time: int | None = None
        """Time of the last servo point [ns]."""
        self._streaming = False
        self._joints: np.ndarray | None = None
        self._placement: Pose | None = None
        self._quality = LinkQuality()
        self._contact_force = ContactForce()
        self.live = link.live

    def enable(self) -> None:
        # Whoever arms has checked that nothing pulls at the gripper.
        self._contact_force.calibrate()
        self._begin_enable()

    def disable(self) -> None:
        self._enable_requested = self._streaming = False
        self._client.disable()

    def recover(self) -> None:
        self._streaming = False
        if self._client.enabled and not self._client.lost:
            return
        self._begin_enable()

    def _begin_enable(self) -> None:
        self._enable_requested, self._streaming = True, False
        self._client.enable()

    def set_gripper(self, close: bool) -> None:
        name = "ToolDOExecute" if self._client.firmware == "v3" else "ToolDOInstant"
        self._client.request(f"{name}({self._tool_output},{int(close)})")
        self._closed = close

    def place(self, pose: Pose) -> bool:
        if not self._emulated:
            return False
        vector = pose_vectors.vector_from_pose(self._kinematics.flange_of_grip(pose))
        # A command of the emulator only; a real arm would answer with an error.
        self._client.request(f"EmulatorPlace({','.join(f'{v:.6f}' for v in vector)})")
        self._placement, self._streaming = pose, False
        return True

    def close(self) -> None:
        self._client.shut_down()

    def step(
        self, now: int, target: Pose | None, velocity: Float64[np.ndarray, "2 3"]
    ) -> ArmFeedback:
        del velocity
        self._client.step(now)
        self._quality.update(self._client.last_packet, self._client.packet_count, now)
        if self._client.enabled and self._client.feedback is not None:
            self._contact_force.update(self._client.feedback["tcp_force"][:3], now)
        feedback = self._feedback(now)
        self._check_placed(feedback.pose)
        if target is not None and feedback.ready and feedback.pose is not None:
            self._follow(now, target, feedback.pose)
        else:
            self._streaming, self._joints = False, None
        return feedback

    def _follow(self, now: int, target: Pose, measured: Pose) -> None:
        """Send a servo point when one is due.

        Time decides, not the number of ticks: the points of a gateway that loses ticks keep their
        pace, or the arm would stop between them and fall behind.
        """
        if self._point_time is not None and now - self._point_time < SERVO_POINT_INTERVAL:
            return
        distance = np.linalg.norm(target.position - measured.position)
        if not self._streaming and distance > FIRST_POINT_DISTANCE:
            return
        self._point_time, self._streaming = now, True
        flange = self._kinematics.flange_of_grip(target)
        if self._client.firmware == "v3" and self._client.timed_joints:
            self._send_joints(flange)
        else:
            self._client.servo_pose(pose_vectors.vector_from_pose(flange), SERVO_POINT_TIME)

    def _send_joints(self, flange: Pose) -> None:
        """Send the joint angles at which the arm's own flange has a pose."""
        packet = self._client.feedback
        assert packet is not None
        actual = np.radians(packet["q_actual"])
        measured = pose_vectors.pose_from_vector(packet["tool_vector_actual"])
        nominal = self._kinematics.flange(actual)
        goal = nominal @ measured.inverse() @ flange
        near = actual if self._joints is None else self._joints
        joints = self._kinematics.solve(self._kinematics.grip_of_flange(goal), near)
        if joints is None or np.max(np.abs(joints - near)) > JOINT_STEP_LIMIT:
            # Constraints keep the command away from here; a deviating arm is a tracking fault.
            return
        self._joints = joints
        self._client.servo_joints(np.degrees(joints), SERVO_POINT_TIME)

    def _feedback(self, now: int) -> ArmFeedback:
        client = self._client
        at_rest = np.zeros((2, 3))
        packet = client.feedback
        if packet is None:
            return ArmFeedback(
                pose=None,
                velocity=at_rest,
                ready=False,
                fault=self._fault(),
                alarms=self._alarm_texts(),
                gripper_closed=self._closed,
                age=np.inf,
                powered=True,
            )
        flange = pose_vectors.pose_from_vector(packet["tool_vector_actual"])
        pose = self._kinematics.grip_of_flange(flange)
        return ArmFeedback(
            pose=pose,
            velocity=self._velocity(packet["tcp_speed_actual"], flange),
            ready=self._ready,
            fault=self._fault(),
            alarms=self._alarm_texts(),
            joints=tuple(np.radians(packet["q_actual"]).tolist()),
            gripper_closed=self._closed,
            age=client.age,
            mode=client.mode_words,
            link_rate=self._quality.rate(now),
            link_gap=self._quality.gap(now),
            contact_force=self._contact_force.magnitude,
            wrench=self._kinematics.grip_wrench(packet["tcp_force"].reshape(2, 3), flange),
            powered=client.powered,
        )

    def _check_placed(self, measured: Pose | None) -> None:
        if self._placement is not None and measured is not None:
            gap = np.linalg.norm(measured.position - self._placement.position)
            self._placement = None if gap < PLACEMENT_TOLERANCE else self._placement

    def _velocity(self, speed: Float64[np.ndarray, "6"], flange: Pose) -> np.ndarray:
        """Return the velocity of the grip for that of the flange [mm/s, deg/s]."""
        return self._kinematics.grip_velocity(
            np.array([speed[:3] / 1e3, np.radians(speed[3:])]), flange
        )

    @property
    def _ready(self) -> bool:
        client = self._client
        following = client.enabled and not client.lost and client.mode in FOLLOWING_MODES
        return following and self._placement is None and self._contact_force.calibrated

    def _fault(self) -> str:
        client = self._client
        if client.lost and (self._enable_requested or client.trouble):
            return "lost_link"
        if self._enable_requested and not client.enabled and not client.busy:
            return "alarm"
        return ""

    def _alarm_texts(self) -> tuple[str, ...]:
        client = self._client
        if client.lost:
            return (client.trouble or client.silence,)
        texts = [text for text in (client.control_lost, *client.alarms) if text]
        if client.failure and client.failure not in texts and not texts:
            texts.append(client.failure)
        if self._enable_requested and not client.enabled and not client.busy and not texts:
            texts.append(f"the arm is {client.mode_words}; acknowledge to make it ready")
        if client.refusal:
            texts.append(client.refusal)
        return tuple(texts)
