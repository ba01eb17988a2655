"""Growth of a solver's time with nodes, with obstacles that the rope touches, and with ropes.

Times are those of the first 50 ms of a motion. With nodes, it is that of the diagram; with
obstacles, both grips descend and lay the rope on spheres that are spread evenly below it, the
engines at steps in which their contacts hold; with ropes, the right grip of each moves by itself,
all of them in one call.
"""

# pyright: reportAttributeAccessIssue=false
# MuJoCo has no stubs.
from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import mujoco
import mujoco.rollout
import numpy as np
from jaxtyping import Float64

from benchmarks.compare import mujoco_ropes, our_rod
from benchmarks.compare.measurement import extra
from benchmarks.compare.motion import (
    ACTION_DURATION,
    PROPERTIES,
    Contender,
    Moves,
    actions,
    rest_state,
)
from lariat.geometry.obstacles import Obstacle, pack
from lariat.rod import Rod, RolloutSpec
from lariat.rod.integration_schemes import Scheme

NODE_COUNTS = (10, 20, 40, 80, 160, 400)
OBSTACLE_COUNTS = (0, 1, 2, 4, 8, 16)
ROPE_COUNTS = (1, 4, 16, 64, 256)
NODE_COUNT, COUNT = 40, 5
"""Number of nodes beside obstacles and of many ropes, and number of actions of 10 ms."""
LONGEST_TIME = 0.01
"""Processor time for 10 ms above which a solver with more nodes is left out [s]."""
CONTACT_STEP = 0.002
"""Time step of MuJoCo with obstacles [s]: at 5 ms, ropes sink into them."""
SPHERE_RADIUS, GAP, DESCENT = 0.01, 0.001, 0.1
"""Radius of the spheres [m], their distance from the rope at the start [m], and speed [m/s]."""
ROUNDS = 2
"""Number of measurements, of which the fastest counts."""


Row = dict[str, Any]
"""Quantity that grows, solver, setting, count, and `us`: least processor time for 10 ms of motion
of one rope."""


def rows() -> list[Row]:
    """Return the times by number of nodes, of obstacles and of ropes."""
    found: dict[tuple[object, ...], Row] = {}
    # In turn, so that what disturbs a machine for seconds does not make one solver slow.
    for _ in range(ROUNDS):
        for row in (*_by_nodes(), *_by_obstacles(), *_by_ropes()):
            key = row["grows"], row["solver"], row["count"]
            found[key] = min(row, found.get(key, row), key=lambda one: one["us"])
    return list(found.values())


def _row(grows: str, solver: str, setting: str, count: int, us: float) -> Row:
    return {"grows": grows, "solver": solver, "setting": setting, "count": count, "us": us}


def _by_nodes() -> Iterator[Row]:
    moves = actions()[20 : 20 + COUNT]
    for make in _solvers():
        for n in NODE_COUNTS:
            contender = make(n)
            us = _run_time(contender, moves)
            yield _row("nodes", contender.solver, contender.setting, n, us)
            if us > 1e6 * LONGEST_TIME:
                break


def _solvers() -> Iterator[Callable[[int], Contender]]:
    """Yield the solvers at a setting each that suits control: fast, and not unstable."""
    for scheme, name in our_rod.NAMES.items():
        yield lambda n, scheme=scheme, name=name: our_rod.rod(scheme, n, 1, name)
    yield lambda n: our_rod.paper_rod(n, 5, 20)
    for name in mujoco_ropes.ROPES:
        yield lambda n, name=name: mujoco_ropes.rope(name, n, ACTION_DURATION)
    if (elastica := extra("elastica")) is not None:
        yield lambda n: elastica.rod(n, elastica.SOFT_STEP_COUNT, stiff=False)
    if (newton := extra("newton")) is not None:
        yield lambda n: newton.cable(n, 0.001, 10)


def _run_time(contender: Contender, moves: Moves) -> float:
    """Return the processor time for 10 ms of motion [us]."""
    # The first run of a setting compiles, reads caches and takes memory.
    contender.start(moves[:1]).run()
    simulation = contender.start(moves)
    began = time.process_time()
    simulation.run()
    return 1e6 * (time.process_time() - began) / len(moves)


def _by_obstacles() -> Iterator[Row]:
    moves = np.zeros((COUNT, 2, 6))
    moves[:, :, 2] = -DESCENT
    start = rest_state(NODE_COUNT)
    for count in OBSTACLE_COUNTS:
        spheres = _spheres(start.positions, count)
        for scheme, name in our_rod.NAMES.items():
            rod = Rod(PROPERTIES, NODE_COUNT, scheme=scheme)
            spec = RolloutSpec(start, moves, ACTION_DURATION, obstacles=pack(spheres))
            us = _call_time(lambda rod=rod, spec=spec: rod.rollout(spec)) / COUNT
            yield _row("obstacles", name, "10 ms", count, us)
        for name in mujoco_ropes.ROPES:
            contender = mujoco_ropes.rope(name, NODE_COUNT, CONTACT_STEP, spheres)
            us = _run_time(contender, moves)
            yield _row("obstacles", name, contender.setting, count, us)


def _spheres(nodes: Float64[np.ndarray, "n 3"], count: int) -> Sequence[Obstacle]:
    """Return spheres below the rope, evenly spaced along it."""
    places = np.linspace(0.0, len(nodes) - 1.0, count + 2)[1:-1].round().astype(int)
    below = np.array([0.0, 0.0, SPHERE_RADIUS + PROPERTIES.diameter / 2.0 + GAP])
    return [
        Obstacle("sphere", (x, y, z), radius=SPHERE_RADIUS) for x, y, z in nodes[places] - below
    ]


def _by_ropes() -> Iterator[Row]:
    start = rest_state(NODE_COUNT)
    for count in ROPE_COUNTS:
        speeds = np.random.default_rng(0).uniform(-0.3, 0.3, (count, 3))
        scale = 1.0 / (COUNT * count)
        moves = np.zeros((count, COUNT, 2, 6))
        moves[:, :, 1, :3] = speeds[:, None]
        spec = RolloutSpec([start] * count, moves, ACTION_DURATION)
        for scheme, name in our_rod.NAMES.items():
            us = scale * _call_time(_ours(scheme, spec))
            yield _row("ropes", name, "10 ms", count, us)
        for name in mujoco_ropes.ROPES:
            us = scale * _call_time(_mujoco(name, speeds))
            yield _row("ropes", name, "10 ms, mujoco.rollout", count, us)


def _ours(scheme: Scheme, spec: RolloutSpec[list]) -> Callable[[], object]:
    rod = Rod(PROPERTIES, NODE_COUNT, scheme=scheme)
    return lambda: rod.rollout(spec)


def _mujoco(name: str, speeds: Float64[np.ndarray, "B 3"]) -> Callable[[], object]:
    run = mujoco_ropes.MujocoRun(
        mujoco_ropes.ROPES[name], NODE_COUNT, ACTION_DURATION, np.zeros((1, 2, 6))
    )
    model, state = run.model, run.state
    kinds = mujoco.mjtState
    start = np.empty(mujoco.mj_stateSize(model, kinds.mjSTATE_FULLPHYSICS))
    mujoco.mj_getState(model, state, start, kinds.mjSTATE_FULLPHYSICS)
    steps = ACTION_DURATION * np.arange(1, COUNT + 1)
    controls = np.empty((len(speeds), COUNT, state.mocap_pos.size + state.mocap_quat.size))
    controls[:] = np.concatenate([state.mocap_pos.ravel(), state.mocap_quat.ravel()])
    controls[:, :, 3:6] += steps[:, None] * speeds[:, None]
    pool = mujoco.rollout.Rollout(nthread=0)
    return lambda: pool.rollout(
        model,
        state,
        np.tile(start, (len(speeds), 1)),
        controls,
        control_spec=kinds.mjSTATE_MOCAP_POS | kinds.mjSTATE_MOCAP_QUAT,
    )


def _call_time(call: Callable[[], object]) -> float:
    """Return the processor time of a call that is not the first [us]."""
    call()
    began = time.process_time()
    call()
    return 1e6 * (time.process_time() - began)
