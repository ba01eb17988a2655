"""Kinematics of the emulated arm, in standard Denavit-Hartenberg parameters.

Independent of the gateway's model, so that each checks the other. `CALIBRATED_GEOMETRY`
differs from `NOMINAL_GEOMETRY` as one real arm from another: by about a millimetre at the flange.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float64

from lariat.geometry import poses

NEWTON_ITERATIONS = 60
"""Most Newton steps of the inverse kinematics."""
NEWTON_DAMPING = 1e-9
"""Damping of the normal equations of a Newton step."""
NEWTON_STEP_LIMIT = 0.5
"""Largest change of a joint in one Newton step [rad]."""
POSE_TOLERANCE = 1e-9
"""Error at which the inverse kinematics have converged [m, rad]."""

Joints = Float64[np.ndarray, "6"]
"""Joint angles [rad]."""
Transform = Float64[np.ndarray, "4 4"]
"""Homogeneous transform, translation in metres."""


@dataclass(frozen=True)
class Geometry:
    """Parameters of T = Rz(theta + offset) Tz(d) Tx(a) Rx(alpha) for each joint."""

    d: tuple[float, ...] = (0.147, 0.0, 0.0, 0.141, 0.116, 0.105)
    """Link offsets [m]."""
    a: tuple[float, ...] = (0.0, -0.427, -0.357, 0.0, 0.0, 0.0)
    """Link lengths [m]."""
    alpha: tuple[float, ...] = (90.0, 0.0, 0.0, 90.0, -90.0, 0.0)
    """Link twists [deg]."""
    offset: tuple[float, ...] = (0.0, -90.0, 0.0, -90.0, 0.0, 0.0)
    """Joint angle offsets [deg]."""

    def frames(self, joints: Joints) -> Float64[np.ndarray, "7 4 4"]:
        """Return the poses of the base and of each link in the base; the last is the flange."""
        offset, a, ca, sa, still = self._arrays
        angle = joints + offset
        ct, st = np.cos(angle), np.sin(angle)
        links = still.copy()
        links[:, 0] = np.array([ct, -st * ca, st * sa, a * ct]).T
        links[:, 1] = np.array([st, ct * ca, -ct * sa, a * st]).T
        frames = np.empty((7, 4, 4))
        frames[0] = np.eye(4)
        for k, link in enumerate(links):
            frames[k + 1] = frames[k] @ link
        return frames

    @cached_property
    def _arrays(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Offsets [rad], lengths [m], cosine and sine of the twists, and what of the links' poses
        does not depend on the joints."""
        ca, sa = np.cos(np.radians(self.alpha)), np.sin(np.radians(self.alpha))
        still = np.zeros((6, 4, 4))
        still[:, 2] = np.stack([np.zeros(6), sa, ca, np.array(self.d)], axis=-1)
        still[:, 3, 3] = 1.0
        return np.radians(self.offset), np.array(self.a), ca, sa, still

    def flange(self, joints: Joints) -> Transform:
        """Return the pose of the flange in the base."""
        return self.frames(joints)[-1]

    def jacobian(self, frames: Float64[np.ndarray, "7 4 4"]) -> Float64[np.ndarray, "6 6"]:
        """Return the Jacobian: linear over angular velocity of the flange, in the base."""
        axes, origins = frames[:6, :3, 2], frames[:6, :3, 3]
        return np.concatenate([poses.cross(axes, frames[6, :3, 3] - origins), axes], axis=1).T

    def solve(self, goal: Transform, near: Joints) -> Joints | None:
        """Return the joints for a flange pose on the branch of `near`; None when there are none.

        Damped Newton steps of bounded length.
        """
        joints = np.array(near, dtype=float)
        for _ in range(NEWTON_ITERATIONS):
            frames = self.frames(joints)
            error = _pose_error(frames[-1], goal)
            if np.max(np.abs(error)) < POSE_TOLERANCE:
                return joints
            J = self.jacobian(frames)
            step = np.linalg.solve(J.T @ J + NEWTON_DAMPING * np.eye(6), J.T @ error)
            joints = joints + step * min(
                1.0, NEWTON_STEP_LIMIT / max(float(np.max(np.abs(step))), 1e-12)
            )
        return None

    def all_solutions(self, goal: Transform) -> list[Joints]:
        """Return all solutions of the inverse kinematics, up to eight, in (-pi, pi].

        Closed form for parallel and intersecting axes, refined for these parameters.
        """
        solutions: list[Joints] = []
        for seed in _closed_form(goal, self):
            joints = self.solve(goal, seed)
            if joints is None:
                continue
            joints = (joints + np.pi) % (2.0 * np.pi) - np.pi
            if all(np.max(np.abs(joints - other)) > 1e-4 for other in solutions):
                solutions.append(joints)
        return solutions


NOMINAL_GEOMETRY = Geometry()
CALIBRATED_GEOMETRY = Geometry(
    d=(0.147, 0.0, 0.0, 0.14121, 0.11618, 0.105),
    a=(0.0, -0.42755, -0.35682, 0.0002, 0.00035, 0.0),
    alpha=(90.05, 0.03, -0.04, 90.12, -89.88, 0.0),
)


def _pose_error(at: Transform, goal: Transform) -> Float64[np.ndarray, "6"]:
    """Return translation and rotation vector from one pose to another [m, rad]."""
    R = goal[:3, :3] @ at[:3, :3].T
    twist = np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]]) / 2.0
    sine, cosine = float(np.linalg.norm(twist)), (float(np.trace(R)) - 1.0) / 2.0
    if sine > 1e-12:
        twist = twist * (np.arctan2(sine, cosine) / sine)
    elif cosine < 0.0:
        # Half a turn: the sign of the axis is arbitrary.
        twist = np.pi * np.sqrt(np.maximum(np.diag(R) + 1.0, 0.0) / 2.0)
    return np.concatenate([goal[:3, 3] - at[:3, 3], twist])


def _closed_form(goal: Transform, geometry: Geometry) -> list[Joints]:
    """Return up to eight solutions for parallel and intersecting axes."""
    d1, _, _, d4, d5, d6 = geometry.d
    _, a2, a3, _, _, _ = geometry.a
    offset = np.radians(geometry.offset)
    wrist = goal[:3, 3] - d6 * goal[:3, 2]
    reach = float(np.hypot(wrist[0], wrist[1]))
    # Seeds are refined: a pose slightly out of the nominal reach may be within this arm's.
    if reach < 0.98 * abs(d4):
        return []
    seeds = []
    for shoulder in (1.0, -1.0):
        swing = shoulder * np.arccos(np.clip(d4 / reach, -1.0, 1.0))
        t1 = np.arctan2(wrist[1], wrist[0]) + swing + np.pi / 2.0
        s1, c1 = np.sin(t1), np.cos(t1)
        cosine = (goal[0, 3] * s1 - goal[1, 3] * c1 - d4) / d6
        for flip in (1.0, -1.0):
            t5 = flip * np.arccos(np.clip(cosine, -1.0, 1.0))
            s5 = np.sin(t5) if abs(np.sin(t5)) > 1e-9 else 1e-9
            t6 = np.arctan2(
                (-goal[0, 1] * s1 + goal[1, 1] * c1) / s5, (goal[0, 0] * s1 - goal[1, 0] * c1) / s5
            )
            middle = (
                np.linalg.inv(_link(t1, d1, 0.0, np.pi / 2.0))
                @ goal
                @ np.linalg.inv(_link(t5, d5, 0.0, -np.pi / 2.0) @ _link(t6, d6, 0.0, 0.0))
            )
            elbow_point = middle @ np.array([0.0, -d4, 0.0, 1.0])
            x, y = elbow_point[0], elbow_point[1]
            square = x * x + y * y
            bend = (square - a2 * a2 - a3 * a3) / (2.0 * a2 * a3)
            if abs(bend) > 1.01:
                continue
            for elbow in (1.0, -1.0):
                t3 = elbow * np.arccos(np.clip(bend, -1.0, 1.0))
                lean = a3 * np.sin(t3) / np.sqrt(square)
                t2 = np.arctan2(-y, -x) - np.arcsin(np.clip(lean, -1.0, 1.0))
                upper = _link(t2, 0.0, a2, 0.0) @ _link(t3, 0.0, a3, 0.0)
                last = np.linalg.inv(upper) @ middle
                t4 = np.arctan2(last[1, 0], last[0, 0])
                seeds.append(np.array([t1, t2, t3, t4, t5, t6]) - offset)
    return seeds


def _link(theta: float, d: float, a: float, alpha: float) -> Transform:
    """Return the transform of one link, from its Denavit-Hartenberg parameters."""
    ct, st, ca, sa = np.cos(theta), np.sin(theta), np.cos(alpha), np.sin(alpha)
    return np.array(
        [
            [ct, -st * ca, st * sa, a * ct],
            [st, ct * ca, -ct * sa, a * st],
            [0.0, sa, ca, d],
            [0.0, 0.0, 0.0, 1.0],
        ]
    )
