"""Feedback packets on ports 30004 to 30006."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float64

from lariat.geometry import poses
from services.cr5_emulator.controller import COLLISION_ALARM, Controller
from services.cr5_emulator.tether import Tether
from shared.cr5 import packet
from shared.cr5.pose_vectors import vector_of


class FeedbackWriter:
    """Writes the packets of one controller."""

    def __init__(self, controller: Controller) -> None:
        self._controller = controller
        self._tether = Tether.of(controller.options.tether)
        self._noise = np.random.default_rng(controller.options.seed)

    def packet(self, now: float) -> bytes:
        """Return the packet of the present state. Args: now: Time stamp [s since 1970]."""
        c = self._controller
        r = packet.blank()
        r["digital_inputs"], r["digital_outputs"] = c.inputs, c.outputs
        r["robot_mode"], r["time_stamp"] = c.mode, round(1e3 * now)
        r["speed_scaling"], r["robot_voltage"] = c.speed_factor, 48.0 if c.powered else 0.0
        self._write_motion(r)
        self._write_state(r)
        if c.v4:
            r["run_time"] = round(1e3 * c.time)
            r["current_command_id"] = c.finished
            r["collision_state"] = COLLISION_ALARM in c.alarms
            # All bits are active low: emergency stop, protective stop, reduced mode, not stopped,
            # moving, system and user emergency stop, safe home.
            pressed = (1 << 0 | 1 << 5) if c.pressed else 0
            r["safety_state"] = 0xFF & ~(pressed | (1 << 4 if c.busy else 1 << 3))
        else:
            r["main_voltage"] = 24.0
        return r.tobytes()

    def _write_motion(self, r: np.ndarray) -> None:
        c = self._controller
        r["q_target"], r["qd_target"] = np.degrees(c.target), np.degrees(c.target_speed)
        r["qdd_target"] = np.degrees(c.target_acceleration)
        r["q_actual"], r["qd_actual"] = np.degrees(c.joints), np.degrees(c.joint_speed)
        r["tcp_force"] = np.ravel(self._wrench())
        for name, joints, speed in (
            ("actual", c.joints, c.joint_speed),
            ("target", c.target, c.target_speed),
        ):
            links = c.geometry.frames(joints)
            if name == "actual" and not c.v4:
                r["elbow_position"] = 1e3 * links[2, :3, 3]
            flange = links[-1]
            r[f"tool_vector_{name}"] = vector_of(flange[:3, 3], flange[:3, :3])
            r[f"{name}_quaternion"] = poses.from_matrix(flange[:3, :3])
            linear, angular = (c.geometry.jacobian(links) @ speed).reshape(2, 3)
            r[f"tcp_speed_{name}"] = np.concatenate([1e3 * linear, np.degrees(angular)])

    def _wrench(self) -> Float64[np.ndarray, "2 3"]:
        """Force and torque on the gripper about the flange, in the base [N, N m]."""
        c = self._controller
        wrench = np.zeros((2, 3))
        wrench[0] = c.options.force_noise * self._noise.normal(size=3)
        if self._tether is not None:
            flange = c.flange(c.joints)
            wrench += self._tether.wrench(flange, flange[:3, 3])
        return wrench

    def _write_state(self, r: np.ndarray) -> None:
        c = self._controller
        r["motor_temperatures"], r["joint_modes"] = 30.0, 8.0
        r["joint_voltages"] = 48.0 if c.powered else 0.0
        r["queue_running"], r["queue_paused"] = c.queue_running, c.paused
        r["velocity_ratio"], r["acceleration_ratio"] = c.ratios["speedj"], c.ratios["accj"]
        for kind in ("xyz", "r"):
            r[f"{kind}_velocity_ratio"] = c.ratios["speedl"]
            r[f"{kind}_acceleration_ratio"] = c.ratios["accl"]
        # A bit for each joint; 1 means released.
        r["brake_status"] = 0b111111 if c.enabled else 0
        r["enable_status"], r["drag_status"] = c.enabled, c.dragging
        r["running_status"], r["error_status"] = c.busy, bool(c.alarms)
        r["jog_status"] = c.jogging
        r["robot_type"] = c.options.robot_type
        r["load"], r["load_center"] = c.load, c.load_center
