"""Whatever the stream says, the commanded motion keeps every limit."""

from __future__ import annotations

import numpy as np
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from services.robot_gateway.motion import Kinematics
from shared.geometry import poses
from shared.geometry.obstacles import TABLE, Obstacle, signed_distance
from tests.services.robot_gateway.cells import ALONG_X, LIMITS, TICK, World, stopping

LENGTH = 0.5
LOW, HIGH = np.array([-0.35, -0.25, 0.05]), np.array([0.35, 0.25, 0.45])
POST = Obstacle("cylinder", (0.25, 0.15, 0.2), radius=0.03, height=0.4, name="post")
BALL = Obstacle("sphere", (-0.1, -0.15, 0.35), radius=0.05, name="ball")
HOSTILE = ("smooth", "jump", "nan", "inf", "huge", "rough", "backwards", "silence", "spin", "stop")
H = TICK * 1e-9

kinds = st.lists(st.sampled_from(HOSTILE + ("smooth",) * 10), min_size=8, max_size=20)


def both_driven(obstacles: list[Obstacle]) -> World:
    return World(
        left="ideal",
        length=LENGTH,
        obstacles=obstacles,
        workspace=(tuple(LOW), tuple(HIGH)),
    )


def send(world: World, kind: str, rng: np.random.Generator, target: np.ndarray) -> None:
    """One chunk of a kind, towards a target that may lie anywhere."""
    here, velocity = world.cell.guidance.state.position, world.cell.guidance.state.velocity[:, 0]
    points, turns = pursuit(here, velocity, target, rng), None
    match kind:
        case "jump":
            points = points + rng.normal(scale=0.05, size=3)
        case "nan":
            points[rng.integers(len(points))] = np.nan
        case "inf":
            points[-1, 0, 1] = np.inf
        case "huge":
            points = points * 1e30
        case "rough":
            points = points + rng.normal(scale=2e-4, size=points.shape)
        case "spin":
            turn = rng.normal(size=3) * np.linspace(0.0, 0.3, len(points))[:, None]
            turns = poses.multiply(poses.exponential(turn), ALONG_X)
            turns = np.repeat(turns[:, None], 2, axis=1)
        case "stop":
            points = np.repeat(here[None], 16, axis=0)
    changes: dict = {} if turns is None else {"orientations": turns}
    if kind == "backwards":
        changes["start"] = world.now - 10_000_000_000
    if kind != "silence":
        world.send_points(points, **changes)


def pursuit(
    here: np.ndarray, velocity: np.ndarray, target: np.ndarray, rng: np.random.Generator
) -> np.ndarray:
    """A writer without judgement: straight to the target, nearly as fast as is allowed."""
    rows, v = [here], velocity.copy()
    speed = rng.uniform(0.1, 0.5)
    for _ in range(15):
        wanted = target - rows[-1]
        far = np.maximum(np.linalg.norm(wanted, axis=1, keepdims=True), 1e-9)
        change = wanted / far * min(speed, 0.49) - v
        size = np.maximum(np.linalg.norm(change, axis=1, keepdims=True), 1e-12)
        v = v + change * np.minimum(1.0, 1.9 * 0.02 / size)
        rows.append(rows[-1] + 0.02 * v)
    return stopping(np.array(rows), 1.9)


@settings(max_examples=15, deadline=None, suppress_health_check=list(HealthCheck))
@given(kinds, st.integers(0, 2**32 - 1), st.booleans())
def test_no_stream_makes_the_command_break_a_limit(
    events: list[str], seed: int, late_ball: bool
) -> None:
    rng = np.random.default_rng(seed)
    world = both_driven([TABLE, POST] if late_ball else [TABLE, POST, BALL])
    for k, kind in enumerate(events):
        target = rng.uniform(LOW - 0.2, HIGH + 0.2, size=(2, 3))
        if late_ball and k == len(events) // 2:
            clear = min(ball_distance(s) for _, s in world.states[-1:])
            if clear > 0.15:
                world.cell.take_scene([TABLE, POST, BALL])
        for _ in range(int(rng.integers(1, 5))):
            send(world, kind, rng, target)
            world.run(0.02)
    begun = world.now
    peak = speed_of(world.cell.guidance.state)
    while not world.cell.guidance.resting and (world.now - begun) * 1e-9 < 3.0:
        world.step()
        if (world.now - begun) * 1e-9 <= 0.15:
            peak = max(peak, speed_of(world.cell.guidance.state))
    # The last fresh chunk came at the latest when this began.
    assert (world.now - begun) * 1e-9 <= 0.15 + peak / LIMITS.acceleration + 2.0 / 40.0 + 2 * H + (
        LIMITS.angular_speed / LIMITS.angular_acceleration
    )
    check_derivatives([s for _, s in world.states])
    for _, state in world.states:
        check_places(state)


def speed_of(state: Kinematics) -> float:
    return float(np.max(np.linalg.norm(state.velocity[:, 0], axis=-1)))


def ball_distance(state: Kinematics) -> float:
    return float(np.min(signed_distance(state.position, BALL)))


def check_derivatives(states: list[Kinematics]) -> None:
    """Speeds, accelerations and jerks, and that the poses move as they say."""
    v = np.array([s.velocity for s in states])
    a = np.array([s.acceleration for s in states])
    for kind, (speed, acceleration, jerk) in enumerate(
        (
            (LIMITS.speed, LIMITS.acceleration, LIMITS.jerk),
            (LIMITS.angular_speed, LIMITS.angular_acceleration, LIMITS.angular_jerk),
        )
    ):
        assert np.max(np.linalg.norm(v[:, :, kind], axis=-1)) <= speed * (1.0 + 1e-6)
        assert np.max(np.linalg.norm(a[:, :, kind], axis=-1)) <= acceleration * (1.0 + 1e-6)
        jerks = np.linalg.norm(np.diff(a[:, :, kind], axis=0), axis=-1) / H
        assert np.max(jerks) <= jerk * (1.0 + 1e-6)
    moved = np.diff(np.array([s.position for s in states]), axis=0) / H
    np.testing.assert_allclose(moved, (v[1:, :, 0] + v[:-1, :, 0]) / 2.0, atol=40.0 * H**2)


def check_places(state: Kinematics) -> None:
    """Workspace, obstacles, spacing and the rope's length."""
    assert np.all(state.position >= LOW - 1e-5)
    assert np.all(state.position <= HIGH + 1e-5)
    distance = np.linalg.norm(state.position[1] - state.position[0])
    assert 0.03 - 1e-5 <= distance <= 0.99 * LENGTH + 1e-5
    body = state.position[:, None] + poses.rotate(
        state.orientation[:, None],
        np.array([[-1.0], [1.0]])[:, :, None] * np.linspace(0.0, 0.048, 20)[:, None] * [0, 0, 1],
    )
    assert np.min(signed_distance(body, POST)) >= 0.012 + 0.005 - 1e-3
