"""Contenders: MuJoCo's ropes, of one flex and of links, as the simulated lab builds them.

Both are stepped by the integrator `discrete`, which is implicit in position. `implicit` and
`implicitfast` are so in velocity alone: they refuse the elasticity of a flex, and the links are
unstable with them in steps down to 0.1 ms. MuJoCo 4 removed its plugin `cable` for the flex.
"""

# pyright: reportAttributeAccessIssue=false
# MuJoCo has no stubs.
from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial

import mujoco
import numpy as np
from jaxtyping import Float64

from benchmarks.compare.motion import (
    ACTION_DURATION,
    LEFT_GRIP,
    PROPERTIES,
    RIGHT_GRIP,
    SETTLING_COUNT,
    SETTLING_DAMPING,
    Contender,
    Moves,
    NodePath,
    grip_path,
    rest_state,
    then_still,
)
from lariat.simulation.plants.flex_rope import FlexRope
from lariat.simulation.plants.linked_rope import LinkedRope
from lariat.simulation.plants.mujoco_rope import MujocoRope

RopeMaker = Callable[[MujocoRope], FlexRope | LinkedRope]
"""Class of a rope of MuJoCo."""
ROPES: dict[str, RopeMaker] = {"MuJoCo flex": FlexRope, "MuJoCo links": LinkedRope}
"""Ropes by the name of the solver."""


def contenders() -> Iterator[Contender]:
    """Yield both ropes; more nodes in the longer steps alone."""
    for name in ROPES:
        for n in (20, 40, 80):
            for step in (0.01, 0.005, 0.002, 0.001, 0.0005)[: 5 if n <= 40 else 3]:
                yield rope(name, n, step)


def rope(name: str, n: int, step: float) -> Contender:
    """Return a rope with one setting."""
    return Contender(name, n, f"{1e3 * step:g} ms", partial(_Run, ROPES[name], n, step))


class _Run:
    """Run of a rope of MuJoCo."""

    def __init__(self, make: RopeMaker, n: int, step: float, moves: Moves) -> None:
        self._moves, p = moves, PROPERTIES
        self._rope = make(MujocoRope(p.length, p.diameter, n, p.linear_density, p.youngs_modulus))
        self._model = mujoco.MjModel.from_xml_string(self._rope.mjcf(()))
        self._model.opt.timestep = step
        self._rope.configure(self._model)
        self._state = mujoco.MjData(self._model)
        for end, pose in enumerate((LEFT_GRIP, RIGHT_GRIP)):
            self._state.mocap_pos[end], self._state.mocap_quat[end] = (
                pose.position,
                pose.orientation,
            )
        self._rope.place(self._state, rest_state(n).positions, (LEFT_GRIP, RIGHT_GRIP))
        mujoco.mj_forward(self._model, self._state)
        self._grips = grip_path(then_still(moves), step)
        self._count, self._done = round(ACTION_DURATION / step), 0
        self._nodes = n

    def run(self) -> NodePath:
        """Return the positions after every action."""
        return self._advance(len(self._moves), PROPERTIES.damping)

    def settle(self) -> Float64[np.ndarray, "n 3"]:
        """Return the positions after the grips have stood still, strongly damped."""
        return self._advance(SETTLING_COUNT, SETTLING_DAMPING)[-1]

    def _advance(self, count: int, damping: float) -> NodePath:
        """Positions after each of the next actions of `then_still`, damped [1/s]."""
        model, state = self._model, self._state
        momentum = np.zeros(model.nv)
        path = np.empty((count, self._nodes, 3))
        positions, orientations = self._grips
        for k in range(count):
            for _ in range(self._count):
                state.mocap_pos[:] = positions[self._done]
                state.mocap_quat[:] = orientations[self._done]
                self._done += 1
                mujoco.mj_mulM(model, state, momentum, state.qvel)
                np.multiply(momentum, -damping, out=state.qfrc_applied)
                mujoco.mj_step(model, state)
            mujoco.mj_kinematics(model, state)
            mujoco.mj_flex(model, state)
            path[k] = self._rope.nodes(state)
        return path
