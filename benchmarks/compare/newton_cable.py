# pyright: reportMissingImports=false, reportOptionalMemberAccess=false
"""Contender: a cable of Newton (`newton`, on `warp`), rigid segments stepped by `SolverVBD`.

Sweeps over the segments descend in the energy of a backward Euler step, in single precision. A
short segment in each grip gives the direction of the clamp: its joint has the stiffness of half an
edge. Steps are recorded once and replayed, which takes a twentieth of the time of their launches.
Few sweeps suffice where stretch and shear are as stiff as modulus and cross-section say, a fortieth
of `PROPERTIES`: marked `E A`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import newton
import numpy as np
import warp
from jaxtyping import Float64

from benchmarks.compare.motion import (
    ACTION_DURATION,
    LEFT_GRIP,
    PROPERTIES,
    RIGHT_GRIP,
    Contender,
    DampedSimulation,
    Moves,
    NodePath,
    grip_path,
    rest_state,
    then_still,
)
from lariat.geometry import poses

NAME = "Newton cable"
"""Name of the solver."""
GRIP_SEGMENT_RATIO = 1e-2
"""Length of the segment in a grip, relative to the others [-]."""
SETTINGS = ((0.005, 10), (0.002, 10), (0.001, 10), (0.001, 40))
"""Time steps [s], and sweeps in each."""
Z = np.array([0.0, 0.0, 1.0])
"""Axis of a segment."""
XYZW, WXYZ = [1, 2, 3, 0], [3, 0, 1, 2]
"""Places of the numbers of a quaternion in the other order."""


def contenders() -> Iterator[Contender]:
    """Yield the cable."""
    for n in (20, 40):
        for step, sweeps in SETTINGS:
            yield cable(n, step, sweeps)
    yield cable(20, 0.001, 40, stiff=True)


def cable(n: int, step: float, sweeps: int, stiff: bool = False) -> Contender:
    """Return the cable with one setting."""
    setting = f"{1e3 * step:g} ms, {sweeps} sweeps{'' if stiff else ', E A'}"
    return Contender(NAME, n, setting, lambda moves: _Run(n, step, sweeps, stiff, moves))


class _Run(DampedSimulation):
    """Run of Newton."""

    def __init__(self, n: int, step: float, sweeps: int, stiff: bool, moves: Moves) -> None:
        super().__init__(moves)
        warp.config.log_level = warp.LOG_ERROR
        self._edge = PROPERTIES.length / (n - 1)
        model = _model(n, self._edge, stiff)
        solver = newton.solvers.SolverVBD(model, iterations=sweeps)
        states = [model.state(), model.state()]
        control = model.control()
        # A step from one state to the other, and one back.
        self._steps = []
        for first, second in (states, states[::-1]):
            with warp.ScopedCapture(device="cpu") as capture:
                solver.step(first, second, control, None, step)
            self._steps.append(capture.graph)
        self._poses = [state.body_q.numpy() for state in states]
        self._velocities = [state.body_qd.numpy() for state in states]
        self._forces = [state.body_f.numpy() for state in states]
        rest = model.state()
        for state in states:
            state.assign(rest)
        self._grips = _grip_bodies(then_still(moves), step, self._edge)
        self._kept = model, solver, states, control
        self._count, self._done = round(ACTION_DURATION / step), 0
        self._nodes = n

    def _advance(self, count: int, damping: float) -> NodePath:
        drag = -damping * PROPERTIES.linear_density * self._edge
        path = np.empty((count, self._nodes, 3))
        for k in range(count):
            for _ in range(self._count):
                now = self._done % 2
                self._poses[0][[0, -1]] = self._poses[1][[0, -1]] = self._grips[self._done]
                self._forces[now][1:-1, :3] = drag * self._velocities[now][1:-1, :3]
                warp.capture_launch(self._steps[now])
                self._done += 1
            path[k] = _nodes(self._poses[self._done % 2][1:-1].astype(float), self._edge)
        return path


def _model(n: int, edge: float, stiff: bool) -> newton.Model:
    p, start = PROPERTIES, rest_state(n)
    stretch = p.stretch_stiffness
    if not stiff:
        stretch = p.youngs_modulus * math.pi * p.diameter**2 / 4.0
    ends = [
        grip.position + side * GRIP_SEGMENT_RATIO * edge * poses.rotate(grip.orientation, Z)
        for grip, side in ((LEFT_GRIP, -1.0), (RIGHT_GRIP, 1.0))
    ]
    rod = newton.Rod(
        np.concatenate([ends[:1], start.positions, ends[1:]]),
        quaternions=start.orientations[:, XYZW],
        rest_straight=True,
        radius=p.diameter / 2.0,
        stretch_rigidity=stretch,
        shear_rigidity=stretch,
        bend_rigidity=p.bending_stiffness,
        twist_rigidity=p.twisting_stiffness,
    )
    builder = newton.ModelBuilder()
    shape = builder.default_shape_cfg.copy()
    shape.has_shape_collision = False
    segments, _ = builder.add_rod(rod=rod, cfg=shape)
    mass, radius = p.linear_density * edge, p.diameter / 2.0
    across = mass * (edge**2 / 12.0 + radius**2 / 4.0)
    inertia = np.diag([across, across, mass * radius**2 / 2.0])
    for segment in segments:
        fixed = segment in (segments[0], segments[-1])
        builder.body_mass[segment] = 0.0 if fixed else mass
        builder.body_inv_mass[segment] = 0.0 if fixed else 1.0 / mass
        builder.body_inertia[segment] = warp.mat33(0.0 if fixed else inertia)
        builder.body_inv_inertia[segment] = warp.mat33(0.0 if fixed else np.linalg.inv(inertia))
    builder.color()
    return builder.finalize(device="cpu")


def _grip_bodies(moves: Moves, step: float, edge: float) -> Float64[np.ndarray, "K 2 7"]:
    """Return the poses of the segments in the grips after every step."""
    positions, orientations = grip_path(moves, step)
    outwards = np.array([-0.5, 0.5])[:, None] * GRIP_SEGMENT_RATIO * edge
    centres = positions + outwards * poses.rotate(orientations, Z)
    return np.concatenate([centres, orientations[..., XYZW]], axis=-1)


def _nodes(segments: Float64[np.ndarray, "n-1 7"], edge: float) -> Float64[np.ndarray, "n 3"]:
    """Return the ends of the segments, in the middle where two differ."""
    centres = segments[:, :3]
    halves = 0.5 * edge * poses.rotate(segments[:, 3:][:, WXYZ], Z)
    lefts, rights = centres - halves, centres + halves
    return np.concatenate([lefts[:1], 0.5 * (lefts[1:] + rights[:-1]), rights[-1:]])
