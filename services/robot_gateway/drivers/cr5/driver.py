"""A CR5 that follows servo points: real, or emulated.

V4 is sent poses. V3's ServoP takes no time and lags by a tenth of a second, so V3 is sent joints
where its firmware takes a time for them. They are solved for with the nominal geometry, which is
first laid over the arm's own: its feedback says for the same instant where its joints are and where
its flange is, and what lies between that and the nominal flange changes slowly along a path.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float64

from lariat.geometry.poses import Pose
from services.robot_gateway.constraints.joints import JointConstraints
from services.robot_gateway.drivers.cr5.client import Client
from services.robot_gateway.drivers.cr5.contact_force import Pull
from services.robot_gateway.drivers.cr5.enable_sequence import Settings
from services.robot_gateway.drivers.cr5.link import Link
from services.robot_gateway.drivers.cr5.link_quality import LinkQuality
from services.robot_gateway.drivers.driver import Feedback
from shared.cr5 import units
from shared.cr5.alarms import FOLLOWING
from shared.cr5.kinematics import Kinematics

POINT_TICKS = 4
"""Ticks between servo points, at rest too, where an arm might take their end for a fault: 32 ms,
just above the 30 ms that the maker recommends."""
POINT_TIME = 0.04
"""In which V4 reaches a point [s]: a little longer than it takes for the next one to come."""
PLACED = 0.004
"""Distance at which an emulated arm is where it was put [m]: its geometry may be calibrated."""
LONGEST_STEP = 0.12
"""Most that a joint turns from one point to the next [rad]: a keen one trips V3's drives."""
FIRST_STEP = 0.005
"""Farthest that the first point may be from where the arm is [m]."""


class Cr5Driver:
    """One CR5 with a gripper at its flange."""

    name = "cr5"
    moves = True
    tracking_limit = 0.02

    def __init__(
        self,
        link: Link,
        kinematics: Kinematics,
        joint_speed: float,
        emulated: bool,
        tool_output: int = 1,
        settings: Settings | None = None,
    ) -> None:
        """Args: emulated: Whether it may be put somewhere. tool_output: Closes the gripper."""
        self._emulated = emulated
        self.joint_constraints: JointConstraints | None = JointConstraints(kinematics, joint_speed)
        self._kinematics = kinematics
        self._client = Client(link, settings)
        self._output = tool_output
        self._closed = True
        self._wanted = False
        self._ticks = 0
        self._streaming = False
        self._joints: np.ndarray | None = None
        self._placing: Pose | None = None
        self._quality = LinkQuality()
        self._pull = Pull()
        self.live = link.live

    def enable(self) -> None:
        # A person who arms has seen that nothing pulls.
        self._pull.begin()
        self._make_ready()

    def disable(self) -> None:
        self._wanted = self._streaming = False
        self._client.disable()

    def recover(self) -> None:
        self._streaming = False
        if self._client.enabled and not self._client.lost:
            return
        self._make_ready()

    def _make_ready(self) -> None:
        self._wanted, self._streaming = True, False
        self._client.enable()

    def grip(self, close: bool) -> None:
        name = "ToolDOExecute" if self._client.firmware == "v3" else "ToolDOInstant"
        self._client.request(f"{name}({self._output},{int(close)})")
        self._closed = close

    def place(self, pose: Pose) -> bool:
        if not self._emulated:
            return False
        vector = units.to_vector(self._kinematics.flange_of_grip(pose))
        # The emulator alone knows this command; a real arm would answer that there is none.
        self._client.request(f"EmulatorPlace({','.join(f'{v:.6f}' for v in vector)})")
        self._placing, self._streaming = pose, False
        return True

    def close(self) -> None:
        self._client.shut_down()

    def step(self, now: int, target: Pose | None, velocity: Float64[np.ndarray, "2 3"]) -> Feedback:
        del velocity
        self._client.step(now)
        self._quality.take(self._client.heard, now)
        if self._client.enabled and self._client.feedback is not None:
            self._pull.take(self._client.feedback["tcp_force"][:3], now)
        feedback = self._feedback(now)
        self._check_placed(feedback.pose)
        if target is not None and feedback.ready and feedback.pose is not None:
            self._follow(target, feedback.pose)
        else:
            self._streaming, self._joints = False, None
        return feedback

    def _follow(self, target: Pose, measured: Pose) -> None:
        """Sends a point when one is due; never a second one in flight within one period."""
        self._ticks += 1
        if self._ticks < POINT_TICKS:
            return
        far = np.linalg.norm(target.position - measured.position)
        if not self._streaming and far > FIRST_STEP:
            return
        self._ticks, self._streaming = 0, True
        flange = self._kinematics.flange_of_grip(target)
        if self._client.firmware == "v3" and self._client.times_joints:
            self._send_joints(flange)
        else:
            self._client.servo_pose(units.to_vector(flange), POINT_TIME)

    def _send_joints(self, flange: Pose) -> None:
        packet = self._client.feedback
        assert packet is not None
        actual = np.radians(packet["q_actual"])
        measured = units.from_vector(packet["tool_vector_actual"])
        nominal = self._kinematics.flange(actual)
        goal = nominal @ measured.inverse() @ flange
        near = actual if self._joints is None else self._joints
        joints = self._kinematics.solve(self._kinematics.grip_of_flange(goal), near)
        if joints is None or np.max(np.abs(joints - near)) > LONGEST_STEP:
            # The rules keep the command from here; an arm that is elsewhere is a tracking fault.
            return
        self._joints = joints
        self._client.servo_joints(np.degrees(joints), POINT_TIME)

    def _feedback(self, now: int) -> Feedback:
        client = self._client
        still = np.zeros((2, 3))
        packet = client.feedback
        if packet is None:
            return Feedback(
                pose=None,
                velocity=still,
                ready=False,
                fault=self._fault(),
                alarms=self._words(),
                gripper_closed=self._closed,
                age=np.inf,
            )
        flange = units.from_vector(packet["tool_vector_actual"])
        pose = self._kinematics.grip_of_flange(flange)
        return Feedback(
            pose=pose,
            velocity=self._velocity(packet["tcp_speed_actual"], flange),
            ready=self._ready,
            fault=self._fault(),
            alarms=self._words(),
            joints=tuple(np.radians(packet["q_actual"]).tolist()),
            gripper_closed=self._closed,
            age=client.age,
            mode=client.mode_words,
            link_rate=self._quality.rate(now),
            link_gap=self._quality.gap(now),
            pull=self._pull.size,
        )

    def _check_placed(self, measured: Pose | None) -> None:
        if self._placing is not None and measured is not None:
            gap = np.linalg.norm(measured.position - self._placing.position)
            self._placing = None if gap < PLACED else self._placing

    def _velocity(self, speed: Float64[np.ndarray, "6"], flange: Pose) -> np.ndarray:
        """Of the grip, which turns with the flange."""
        return self._kinematics.grip_velocity(
            np.array([speed[:3] / 1e3, np.radians(speed[3:])]), flange
        )

    @property
    def _ready(self) -> bool:
        client = self._client
        well = client.enabled and not client.lost and client.mode in FOLLOWING
        return well and self._placing is None and self._pull.calibrated

    def _fault(self) -> str:
        client = self._client
        if client.lost and (self._wanted or client.trouble):
            return "lost_link"
        if self._wanted and not client.enabled and not client.busy:
            return "alarm"
        return ""

    def _words(self) -> tuple[str, ...]:
        client = self._client
        if client.lost:
            return (client.trouble or client.silence,)
        words = [word for word in (client.control_lost, *client.alarms) if word]
        if client.failure and client.failure not in words and not words:
            words.append(client.failure)
        if self._wanted and not client.enabled and not client.busy and not words:
            words.append(f"the arm is {client.mode_words}; acknowledge to make it ready")
        if client.refusal:
            words.append(client.refusal)
        return tuple(words)
