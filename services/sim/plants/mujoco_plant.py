"""The rope played by MuJoCo: independent of our own rod."""

from __future__ import annotations

import math
from collections.abc import Sequence

import mujoco
import numpy as np
from jaxtyping import Float64

from lariat.geometry import polylines
from lariat.geometry.obstacles import Obstacle
from lariat.geometry.poses import Pose
from services.sim.plants.mujoco_model import TIMESTEP, RopeTruth, mjcf
from services.sim.plants.plant import EndMotion, slack_curve, way

REST_SPEED = 1e-4
"""A rope slower than this is at rest [m/s]."""


class MujocoPlant:
    """A flex between two mocap grippers."""

    def __init__(self, rope: RopeTruth, obstacles: Sequence[Obstacle] = ()) -> None:
        self.rope = rope
        self._build(obstacles)
        self._ends: list[EndMotion] = [
            EndMotion(Pose(p.copy(), q.copy()))
            for p, q in zip(self._state.mocap_pos, self._state.mocap_quat, strict=True)
        ]
        self._ahead = 0.0

    @property
    def nodes(self) -> Float64[np.ndarray, "n 3"]:
        """Where the rope is now, left end first [m]."""
        return self._state.flexvert_xpos.copy()

    def reset(
        self, left: Pose, right: Pose, guess: Float64[np.ndarray, "m 3"] | None = None
    ) -> None:
        """Puts the rope at rest between two grips, near `guess` where several rests exist.

        Raises:
            ValueError: The grips are further apart than the rope is long.
        """
        n, length = self.rope.node_count, self.rope.length
        gap = float(np.linalg.norm(left.position - right.position))
        if gap > length:
            raise ValueError(
                f"the grips are {gap:.4f} m apart, the rope is {length} m long; "
                "bring them closer together"
            )
        mujoco.mj_resetData(self._model, self._state)
        self._ends = [EndMotion(left), EndMotion(right)]
        self._ahead = 0.0
        curve = slack_curve(left, right, length, n) if guess is None else guess
        curve = polylines.resampled(np.asarray(curve, float), n)
        self._place(self._ends)
        self._state.qpos[self._slides] = (curve[2:-2] - self._origins).ravel()
        mujoco.mj_forward(self._model, self._state)
        self._settle()

    def set_obstacles(self, obstacles: Sequence[Obstacle]) -> None:
        """Replaces everything that the rope can touch; the rope keeps its state."""
        old = self._state
        self._build(obstacles)
        self._state.time = old.time
        for name in ("qpos", "qvel", "mocap_pos", "mocap_quat", "qacc_warmstart"):
            getattr(self._state, name)[:] = getattr(old, name)
        mujoco.mj_forward(self._model, self._state)

    def step(self, left: EndMotion, right: EndMotion, duration: float) -> None:
        """Moves the grips there within `duration` [s] and the rope with them.

        Time is cut into whole steps of the engine; what is left of one is kept for the next call.
        """
        goals = [left, right]
        if duration > 0.0:
            first = TIMESTEP - self._ahead
            count = max(0, 1 + math.floor((duration - first) / TIMESTEP + 1e-9))
            times = np.minimum(first + TIMESTEP * np.arange(count), duration)
            ways = [way(a, b, duration, times) for a, b in zip(self._ends, goals, strict=True)]
            for k in range(count):
                for row, (positions, orientations) in enumerate(ways):
                    self._state.mocap_pos[row] = positions[k]
                    self._state.mocap_quat[row] = orientations[k]
                mujoco.mj_step(self._model, self._state)
            self._ahead = duration - (first + TIMESTEP * (count - 1))
        self._ends = goals
        # The clamped vertices follow the grips at once.
        self._place(goals)
        mujoco.mj_kinematics(self._model, self._state)
        mujoco.mj_flex(self._model, self._state)

    def _build(self, obstacles: Sequence[Obstacle]) -> None:
        rope = self.rope
        self._model = mujoco.MjModel.from_xml_string(mjcf(rope, obstacles))
        self._state = mujoco.MjData(self._model)
        mass = self._model.body_mass[self._model.dof_bodyid]
        slides = self._model.jnt_type == mujoco.mjtJoint.mjJNT_SLIDE
        self._slides = self._model.jnt_qposadr[slides]
        dofs = self._model.jnt_dofadr[slides]
        self._model.dof_damping[dofs] = rope.damping * mass[dofs]
        bodies = self._model.jnt_bodyid[slides][::3]
        self._origins = self._model.body_pos[bodies].copy()
        if rope.stiffness_profile:
            self._scale_stiffness()
        mujoco.mj_forward(self._model, self._state)

    def _scale_stiffness(self) -> None:
        profile = np.array(self.rope.stiffness_profile)
        # The engine's layout: a count, then ten numbers for every pair of neighbouring edges, of
        # which the fifth is the bending stiffness and the ninth the twisting stiffness.
        joints = int(self._model.flex_bending[0])
        rows = self._model.flex_bending[1 : 1 + 10 * joints].reshape(joints, 10)
        at = np.linspace(0.0, len(profile) - 1.0, joints)
        rows[:, (4, 8)] *= np.interp(at, np.arange(len(profile)), profile)[:, None]

    def _place(self, ends: Sequence[EndMotion]) -> None:
        for row, end in enumerate(ends):
            self._state.mocap_pos[row] = end.pose.position
            self._state.mocap_quat[row] = end.pose.orientation

    def _settle(self) -> None:
        damping = self._model.dof_damping.copy()
        # Strongly damped first, so that the guess does not swing; then as it is.
        self._model.dof_damping[:] *= max(1.0, 8.0 / max(self.rope.damping, 1e-3))
        for _ in range(2000):
            for _ in range(10):
                mujoco.mj_step(self._model, self._state)
            if np.max(np.abs(self._state.qvel[:-1])) < REST_SPEED and self._state.time > 0.5:
                break
        self._model.dof_damping[:] = damping
        self._state.qvel[:] = 0.0
        mujoco.mj_forward(self._model, self._state)
