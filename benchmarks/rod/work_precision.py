"""Work-precision of solvers: error against processor time, for the same motion.

A rope hangs between two clamps, one of which translates and turns about its axis for half a second
and then stands still for as long. Every solver starts from the rest shape. All are compared with
the continuum: in motion with a rod of eight times the nodes in second-order steps of 0.5 ms, at
rest with the solution of the boundary value problem. Each solver is also compared with itself at
very fine steps: the error of the time integration alone.
"""

from __future__ import annotations

import importlib.util
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import mujoco
import numpy as np
from jaxtyping import Float64

from benchmarks.physics.continuum import equilibrium
from lariat.geometry import poses
from lariat.geometry.poses import Pose
from lariat.rod import Rod, RodProperties, RodState, RolloutSpec
from lariat.rod.integration_schemes import Scheme
from lariat.rod.xpbd import XpbdProperties, XpbdRod
from services.sim.plants.flex_rope import FlexRope
from services.sim.plants.linked_rope import LinkedRope
from services.sim.plants.mujoco_rope import MujocoRope

NODE_COUNT, ACTION_DURATION, ACTION_COUNT = 40, 0.01, 100
"""Number of nodes, duration of an action [s], number of actions."""
PROPERTIES = RodProperties(0.45, 0.008, 0.044, 1e6, damping=1.0)
"""Properties of the rope."""
ALONG_X = poses.rotation_between(np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0]))
"""Orientation of a grip that holds the rope along x."""
LEFT_GRIP = Pose(np.array([-0.17, 0.0, 0.4]), ALONG_X)
RIGHT_GRIP = Pose(np.array([0.17, 0.0, 0.4]), ALONG_X)
"""Grips at the start."""
REFERENCE_SUBSTEPS = 100
"""Sub-steps of a solver's own reference: 0.1 ms each."""
REFINEMENT, CONTINUUM_SUBSTEPS = 8, 20
"""Edges of the continuum's rod for each edge of the others, and its sub-steps: 0.5 ms each."""

NodePath = Float64[np.ndarray, "H n 3"]
"""Node positions after every action [m]."""
RopeMaker = Callable[[MujocoRope], FlexRope | LinkedRope]
"""Class of a rope of MuJoCo."""


@dataclass(frozen=True)
class WorkPrecision:
    """Time and errors of a solver with one setting."""

    solver: str
    """Name of the solver."""
    setting: str
    """Sub-steps, sub-steps x sweeps, or time step."""
    us: float
    """Least processor time of three runs, for 10 ms of motion [us]."""
    moving_mm: float
    """Mean node distance from the continuum in motion [mm]."""
    worst_mm: float
    """Largest node distance from the continuum in motion [mm]."""
    rest_mm: float
    """Mean node distance from the continuum at rest [mm]."""
    in_time_mm: float
    """Mean node distance from the same solver with very fine steps, in motion [mm]."""


@dataclass(frozen=True)
class _Continuum:
    """Motion and final rest shape of the continuum, at the nodes."""

    motion: NodePath
    rest: Float64[np.ndarray, "n 3"]


def actions() -> Float64[np.ndarray, "H 2 6"]:
    """Return the velocities of both grips [m/s, rad/s]."""
    t = (np.arange(ACTION_COUNT) + 0.5) * ACTION_DURATION
    bell = np.where(t < 0.5, np.sin(np.pi * t / 0.5) ** 2, 0.0)
    moves = np.zeros((ACTION_COUNT, 2, 6))
    moves[:, 1] = bell[:, None] * np.array([-0.3, 0.4, 0.2, 6.0, 0.0, 2.0])
    return moves


def points() -> Iterator[WorkPrecision]:
    """Yield points of the rod, the paper's solver, MuJoCo and, if installed, PyElastica."""
    rod = Rod(PROPERTIES, NODE_COUNT)
    start = rod.rest(LEFT_GRIP, RIGHT_GRIP).state
    moves = actions()
    continuum = _continuum(moves)
    exact = Rod(PROPERTIES, NODE_COUNT, tolerance=1e-10, scheme="sdirk2")
    own = _rollout(exact, start, moves, REFERENCE_SUBSTEPS)
    moved = rod.rollout(RolloutSpec(start, moves, ACTION_DURATION, substeps=10)).final
    still = rod.rest(*_final_grips(), guess=moved).state.positions
    schemes: tuple[Scheme, ...] = ("euler", "sdirk2")
    for scheme in schemes:
        for substeps in (1, 2, 5, 10, 20):
            solver = Rod(PROPERTIES, NODE_COUNT, scheme=scheme)

            def run_rod(solver: Rod = solver, substeps: int = substeps) -> NodePath:
                return _rollout(solver, start, moves, substeps)

            yield _point(f"direct {scheme}", f"{substeps}", run_rod, own, still, continuum)
    yield from _paper(start, moves, continuum)
    for make, name in ((FlexRope, "MuJoCo flex"), (LinkedRope, "MuJoCo links")):
        yield from _mujoco(name, make, start, moves, continuum)
    if importlib.util.find_spec("elastica") is None:
        yield WorkPrecision("PyElastica", "not installed", *[np.nan] * 5)
    else:
        yield from _elastica(start, moves, continuum)


def _continuum(moves: Float64[np.ndarray, "H 2 6"]) -> _Continuum:
    fine = Rod(PROPERTIES, REFINEMENT * (NODE_COUNT - 1) + 1, tolerance=1e-9, scheme="sdirk2")
    start = fine.rest(LEFT_GRIP, RIGHT_GRIP).state
    motion = fine.rollout(RolloutSpec(start, moves, ACTION_DURATION, substeps=CONTINUUM_SUBSTEPS))
    grips = _final_grips()
    rest = fine.rest(*grips, guess=motion.final).state
    return _Continuum(
        motion.positions[:, ::REFINEMENT],
        equilibrium(fine, *grips, rest).positions(NODE_COUNT),
    )


def _point(
    solver: str,
    setting: str,
    run: Callable[[], NodePath],
    own: NodePath,
    still: Float64[np.ndarray, "n 3"],
    continuum: _Continuum,
) -> WorkPrecision:
    found = run()
    times = []
    for _ in range(3):
        begin = time.process_time()
        run()
        times.append(time.process_time() - begin)
    return WorkPrecision(
        solver,
        setting,
        1e6 * min(times) / ACTION_COUNT,
        _mean(found - continuum.motion),
        1e3 * float(np.linalg.norm(found - continuum.motion, axis=2).max()),
        _mean(still - continuum.rest),
        _mean(found - own),
    )


def _mean(offsets: Float64[np.ndarray, "*H n 3"]) -> float:
    """Return the mean length of offsets, in millimetres."""
    return 1e3 * float(np.linalg.norm(offsets, axis=-1).mean())


def _rollout(
    rod: Rod, start: RodState, moves: Float64[np.ndarray, "H 2 6"], substeps: int
) -> NodePath:
    return rod.rollout(RolloutSpec(start, moves, ACTION_DURATION, substeps=substeps)).positions


def _final_grips() -> tuple[Pose, Pose]:
    moves = actions()
    q = ALONG_X
    for omega in moves[:, 1, 3:]:
        q = poses.multiply(poses.exponential(ACTION_DURATION * omega), q)
    return LEFT_GRIP, Pose(RIGHT_GRIP.position + ACTION_DURATION * moves[:, 1, :3].sum(0), q)


def _paper(
    start: RodState, moves: Float64[np.ndarray, "H 2 6"], continuum: _Continuum
) -> Iterator[WorkPrecision]:
    properties = XpbdProperties.of_material(PROPERTIES, NODE_COUNT)
    spec = RolloutSpec(start, moves, ACTION_DURATION, substeps=20)
    truth = XpbdRod(properties, NODE_COUNT, iterations=400).rollout(spec)
    for substeps, sweeps in ((1, 20), (5, 4), (1, 100), (5, 20), (20, 5)):
        rod = XpbdRod(properties, NODE_COUNT, iterations=sweeps)

        def run(rod: XpbdRod = rod, substeps: int = substeps) -> NodePath:
            return rod.rollout(
                RolloutSpec(start, moves, ACTION_DURATION, substeps=substeps)
            ).positions

        still = rod.rollout(
            RolloutSpec(
                start,
                np.concatenate([moves, np.zeros((400, 2, 6))]),
                ACTION_DURATION,
                substeps=substeps,
            )
        )
        yield _point(
            "xpbd",
            f"{substeps} x {sweeps}",
            run,
            truth.positions,
            still.positions[-1],
            continuum,
        )


class MujocoRun:
    """Rope of MuJoCo as the simulated lab builds it, with a given time step."""

    def __init__(self, make: RopeMaker, start: RodState, step: float, damping: float = 1.0) -> None:
        p = PROPERTIES
        self.rope = make(
            MujocoRope(p.length, p.diameter, NODE_COUNT, p.linear_density, p.youngs_modulus)
        )
        self.model = mujoco.MjModel.from_xml_string(self.rope.mjcf([]))
        self.model.opt.timestep = step
        self.rope.configure(self.model)
        self.state = mujoco.MjData(self.model)
        self.step, self.damping = step, damping
        self.momentum = np.zeros(self.model.nv)
        for end, pose in enumerate((LEFT_GRIP, RIGHT_GRIP)):
            self.state.mocap_pos[end], self.state.mocap_quat[end] = pose.position, pose.orientation
        self.rope.place(self.state, start.positions, (LEFT_GRIP, RIGHT_GRIP))
        mujoco.mj_forward(self.model, self.state)

    def run(self, moves: Float64[np.ndarray, "H 2 6"]) -> NodePath:
        """Return the positions after every action; the ends follow the grips."""
        grips = [[pose.position.copy(), pose.orientation] for pose in (LEFT_GRIP, RIGHT_GRIP)]
        count = round(ACTION_DURATION / self.step)
        path = np.empty((len(moves), NODE_COUNT, 3))
        for k, action in enumerate(moves):
            for _ in range(count):
                for end, (position, q) in enumerate(grips):
                    position = position + self.step * action[end, :3]
                    q = poses.multiply(poses.exponential(self.step * action[end, 3:]), q)
                    grips[end] = [position, q]
                    self.state.mocap_pos[end], self.state.mocap_quat[end] = position, q
                mujoco.mj_mulM(self.model, self.state, self.momentum, self.state.qvel)
                np.multiply(self.momentum, -self.damping, out=self.state.qfrc_applied)
                mujoco.mj_step(self.model, self.state)
            mujoco.mj_kinematics(self.model, self.state)
            mujoco.mj_flex(self.model, self.state)
            path[k] = self.rope.nodes(self.state)
        return path


def _mujoco(
    name: str,
    make: RopeMaker,
    start: RodState,
    moves: Float64[np.ndarray, "H 2 6"],
    continuum: _Continuum,
) -> Iterator[WorkPrecision]:
    own = MujocoRun(make, start, ACTION_DURATION / REFERENCE_SUBSTEPS).run(moves)
    for step in (0.01, 0.005, 0.002, 0.001, 0.0005):
        damped = MujocoRun(make, start, step, damping=6.0)
        still = damped.run(np.concatenate([moves, np.zeros((200, 2, 6))]))[-1]

        def run(step: float = step) -> NodePath:
            return MujocoRun(make, start, step).run(moves)

        yield _point(name, f"{1e3 * step:g} ms", run, own, still, continuum)


def _elastica(
    start: RodState, moves: Float64[np.ndarray, "H 2 6"], continuum: _Continuum
) -> Iterator[WorkPrecision]:
    from benchmarks.rod import pyelastica

    grips = [LEFT_GRIP, RIGHT_GRIP]
    # Stability limits the step: twice the longest step of each is unstable.
    for name, stiff, tried in (
        ("PyElastica", True, (1e-5,)),
        ("PyElastica, stretch 40 times softer", False, (5e-5, 1e-4)),
    ):
        truth = pyelastica.rollout(
            PROPERTIES, start, grips, moves, ACTION_DURATION, 0.5 * tried[0], 1.0, stiff
        )
        longer = np.concatenate([moves, np.zeros((200, 2, 6))])
        for step in tried:
            still = pyelastica.rollout(
                PROPERTIES, start, grips, longer, ACTION_DURATION, step, 6.0, stiff
            )[-1]

            def run(step: float = step, stiff: bool = stiff) -> NodePath:
                return pyelastica.rollout(
                    PROPERTIES, start, grips, moves, ACTION_DURATION, step, 1.0, stiff
                )

            yield _point(name, f"{1e3 * step:g} ms", run, truth, still, continuum)
