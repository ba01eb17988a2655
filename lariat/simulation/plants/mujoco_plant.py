"""Plant that simulates the rope by MuJoCo, independent of Lariat's own rod."""

# pyright: reportAttributeAccessIssue=false
# MuJoCo has no stubs.
from __future__ import annotations

import logging
import math
from collections.abc import Sequence
from copy import copy

import mujoco
import numpy as np
from jaxtyping import Float64

from lariat.configuration import ConfigurationError
from lariat.geometry import polylines
from lariat.geometry.obstacles import Obstacle
from lariat.geometry.poses import Pose
from lariat.simulation.plants.end_motion import EndMotion, interpolate
from lariat.simulation.plants.mujoco_rope import TIMESTEP, RopeModel
from lariat.simulation.plants.slack_curve import slack_curve

log = logging.getLogger(__name__)

REST_SPEED = 2e-5
"""Mean speed of every node between two checks below which the rope counts as at rest [m/s]."""
SETTLING_DAMPING = 5.0
"""Least damping while the rope settles, over the rate of a pendulum of its length [-]."""
MIN_SETTLING_TIME = 0.5
"""Least time for which the rope settles at a reset [s]."""
MAX_SETTLING_TIME = 8.0
"""Longest time for which the rope settles at a reset [s]."""
DIVERGENCE = [
    int(mujoco.mjtWarning.mjWARN_BADQPOS),
    int(mujoco.mjtWarning.mjWARN_BADQVEL),
    int(mujoco.mjtWarning.mjWARN_BADQACC),
]
"""Warnings of the engine that its numbers have become infinite or huge."""
STEPS_PER_CHECK = 10
"""Steps of the engine between two of these checks."""
ORIGIN = (0.0, 0.0, 0.0)
"""Origin of the world [m]."""
WHOLE_CELL = (0.0, 0.0, 0.0, 1000.0, 1000.0, 1000.0)
"""Centre and half extents of a box that contains all obstacles wherever they move [m]."""
RELAXATION_FACTOR = 0.5
"""Factor on all velocities after each step of the relaxation [-]."""


class MujocoPlant:
    """Rope of MuJoCo between two mocap grippers."""

    def __init__(
        self, rope: RopeModel, obstacles: Sequence[Obstacle] = (), timestep: float = TIMESTEP
    ) -> None:
        """Create a rope in its unloaded shape.

        Args:
            rope: Representation of the true rope.
            obstacles: Obstacles that the rope can touch.
            timestep: Time step of the engine [s]. `step` leaves the rope behind by up to one, where
                its durations are no multiples.
        """
        self._timestep = timestep
        # The engine's own handler writes MUJOCO_LOG.TXT into the working folder.
        mujoco.set_mju_user_warning(_log_warning)
        self._rope = rope
        self._damping = rope.rope.damping
        self._build(obstacles)
        self._ends: list[EndMotion] = [
            EndMotion(Pose(p.copy(), q.copy()))
            for p, q in zip(self._state.mocap_pos, self._state.mocap_quat, strict=True)
        ]
        self._remainder = 0.0
        self._moved = False
        """Whether the engine has made steps, or grips have moved, since its last kinematics."""

    @property
    def nodes(self) -> Float64[np.ndarray, "n 3"]:
        """Node positions, left end first [m]."""
        if self._moved:
            # Kinematics again, so that the clamped vertices are where the grips are.
            self._place(self._ends)
            mujoco.mj_kinematics(self._model, self._state)
            mujoco.mj_flex(self._model, self._state)
            self._moved = False
        return self._rope.nodes(self._state)

    @property
    def tension(self) -> float:
        """Largest tension along the rope in the last step of the engine [N]."""
        return max(0.0, float(np.max(self._rope.tensions(self._model, self._state))))

    def reset(
        self, left: Pose, right: Pose, guess: Float64[np.ndarray, "m 3"] | None = None
    ) -> None:
        """Put the rope at rest between two grips.

        Args:
            left: Pose of the left grip.
            right: Pose of the right grip.
            guess: Points along the rope, left end first [m]; the rope comes to rest near them
                where there are several rest shapes.

        Raises:
            ValueError: The grips are further apart than the rope is long.
            ConfigurationError: The engine cannot simulate this rope.
        """
        n, length = self._rope.rope.node_count, self._rope.rope.length
        gap = float(np.linalg.norm(left.position - right.position))
        if gap > length:
            raise ValueError(
                f"the grips are {gap:.4f} m apart, the rope is {length} m long; "
                "bring them closer together"
            )
        self._ends = [EndMotion(left), EndMotion(right)]
        self._remainder = 0.0
        self._moved = False
        curve = slack_curve(left, right, length, n) if guess is None else guess
        curve = polylines.resample(np.asarray(curve, float), n)
        grips = [part for end in self._ends for part in (end.pose.position, end.pose.orientation)]
        key = np.concatenate([*grips, curve.ravel()]).tobytes(), self._obstacles
        if self._rest is not None and self._rest[0] == key:
            mujoco.mj_copyData(self._state, self._model, self._rest[1])
            return
        mujoco.mj_resetData(self._model, self._state)
        self._place(self._ends)
        self._rope.place(self._state, curve, (left, right))
        mujoco.mj_forward(self._model, self._state)
        self._relax()
        self._settle()
        if self._rope.rope.layers:
            # The rope keeps nothing of the shapes on its way from the guess.
            self._state.plastic[:] = 0.0
            self._settle()
        self._check()
        self._rest = key, copy(self._state)

    def release(self, end: int) -> None:
        """Let the rope slip out of a grip; see `Plant.release`."""
        self._rope.release(self._state, end)

    def set_obstacles(self, obstacles: Sequence[Obstacle]) -> None:
        """Replace all obstacles; the rope keeps its state."""
        if [o.moved(ORIGIN) for o in obstacles] == [o.moved(ORIGIN) for o in self._obstacles]:
            self._move_obstacles(obstacles)
            return
        old = self._state
        self._place(self._ends)
        self._build(obstacles)
        self._state.time = old.time
        for name in ("qpos", "qvel", "mocap_pos", "mocap_quat", "qacc_warmstart", "eq_active"):
            getattr(self._state, name)[:] = getattr(old, name)
        mujoco.mj_forward(self._model, self._state)
        self._moved = False

    def step(self, left: EndMotion, right: EndMotion, duration: float) -> None:
        """Move the grips to their new motion within `duration` [s], and the rope with them.

        The engine makes whole steps; the remainder of the duration is carried to the next call.

        Raises:
            ConfigurationError: The engine cannot simulate this rope.
        """
        goals, state = [left, right], self._state
        if duration > 0.0:
            first = self._timestep - self._remainder
            count = max(0, 1 + math.floor((duration - first) / self._timestep + 1e-9))
            times = np.minimum(first + self._timestep * np.arange(count), duration)
            positions, orientations = interpolate(self._ends, goals, duration, times)
            for k in range(count):
                state.mocap_pos[:] = positions[:, k]
                state.mocap_quat[:] = orientations[:, k]
                self._advance()
            self._remainder = duration - (first + self._timestep * (count - 1))
            self._check()
        self._ends = goals
        self._moved = True

    def _move_obstacles(self, obstacles: Sequence[Obstacle]) -> None:
        """Put the obstacles of the model elsewhere, without a new model."""
        model = self._model
        # The world's geoms come first, in the order of the obstacles.
        places = np.array([o.position for o in obstacles])
        moves = places - model.geom_pos[: len(places)]
        model.geom_pos[: len(places)] = places
        model.geom_sameframe[: len(places)] = 0
        # The boxes in which the engine seeks contacts with the world are those of the compiler.
        for node in range(model.body_bvhadr[0], model.body_bvhadr[0] + model.body_bvhnum[0]):
            geom = model.bvh_nodeid[node]
            if geom >= 0:
                model.bvh_aabb[node, :3] += moves[geom]
            else:
                model.bvh_aabb[node] = WHOLE_CELL
        self._obstacles = tuple(obstacles)

    def _build(self, obstacles: Sequence[Obstacle]) -> None:
        self._obstacles = tuple(obstacles)
        self._model = mujoco.MjModel.from_xml_string(self._rope.mjcf(obstacles))
        self._state = mujoco.MjData(self._model)
        # The last reset and its rest state: the next reset is likely to be the same.
        self._rest: tuple[tuple[bytes, tuple[Obstacle, ...]], mujoco.MjData] | None = None
        self._momentum = np.zeros(self._model.nv)
        self._model.opt.timestep = self._timestep
        self._rope.configure(self._model)
        mujoco.mj_forward(self._model, self._state)

    def _advance(self) -> None:
        # Damping in proportion to mass, in whatever coordinates the rope has.
        mujoco.mj_mulM(self._model, self._state, self._momentum, self._state.qvel)
        np.multiply(self._momentum, -self._damping, out=self._state.qfrc_applied)
        if self._rope.rope.in_air:
            self._rope.add_air_drag(self._state)
        mujoco.mj_step(self._model, self._state)

    def _check(self) -> None:
        """Raise an error where the engine's numbers have become infinite or huge."""
        if self._state.warning.number[DIVERGENCE].any():
            rope = self._rope.rope
            raise ConfigurationError(
                f"MuJoCo's simulation of the rope diverges with {rope.node_count} nodes and "
                f"EI = {rope.bending_stiffness:.3g} N m^2; lower plant.rope.node_count, raise "
                "plant.rope.damping, or choose another plant.model"
            )

    def _relax(self) -> None:
        """Let the rope creep out of its guess, where it would whip."""
        for _ in range(self._rope.relaxation_steps):
            self._advance()
            self._state.qvel *= RELAXATION_FACTOR

    def _place(self, ends: Sequence[EndMotion]) -> None:
        for row, end in enumerate(ends):
            self._state.mocap_pos[row] = end.pose.position
            self._state.mocap_quat[row] = end.pose.orientation

    def _settle(self) -> None:
        # More damping while the rope settles, so that it does not swing for long.
        rate = math.sqrt(-self._model.opt.gravity[2] / self._rope.rope.length)
        self._damping = max(self._rope.rope.damping, SETTLING_DAMPING * rate)
        reach = REST_SPEED * STEPS_PER_CHECK * self._timestep
        nodes = self.nodes
        for _ in range(round(MAX_SETTLING_TIME / (STEPS_PER_CHECK * self._timestep))):
            before = nodes
            for _ in range(STEPS_PER_CHECK):
                self._advance()
            nodes = self.nodes
            at_rest = np.max(np.abs(nodes - before)) < reach
            if at_rest and self._state.time > MIN_SETTLING_TIME:
                break
        self._damping = self._rope.rope.damping
        self._state.qvel[:] = 0.0
        mujoco.mj_forward(self._model, self._state)


def _log_warning(text: str) -> None:
    """Log a warning of the engine."""
    log.warning("MuJoCo: %s", text)
