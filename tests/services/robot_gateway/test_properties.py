"""Whatever the stream says, the commanded motion keeps every limit."""

from __future__ import annotations

import numpy as np
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from lariat.geometry import poses
from lariat.geometry.obstacles import TABLE, Obstacle, signed_distance
from lariat.safety.constraints.shortest_path import shortest_path_length
from lariat.trajectory import MotionState
from tests.services.robot_gateway.cells import LIMITS, TICK, World, stopping

LENGTH = 0.5
SPACING = 0.06
"""Of the grips [m]: more than what the gripper's bodies need side by side."""
LOW, HIGH = np.array([-0.35, -0.25, 0.05]), np.array([0.35, 0.25, 0.45])
POST = Obstacle("cylinder", (0.25, 0.15, 0.2), radius=0.03, height=0.4, name="post")
HOSTILE = ("smooth", "jump", "nan", "inf", "huge", "rough", "backwards", "silence", "spin", "stop")
HOSTILE += ("twice", "stranger", "short", "long_silence", "hold", "sparse")
H = TICK * 1e-9
LASTING = ("smooth", "spin")
"""Kinds that come often enough to get up to speed."""
BRAKES = 0.05 + 0.05 + 2 * H
"""After the last chunk the command is slower and slower: 50 ms of patience, as many to shed what
acceleration it has, and two ticks [s]."""
LONGEST = 0.024
"""Of one step of the command, however long the gateway was kept from it [s]."""

kinds = st.lists(
    st.sampled_from(HOSTILE + ("smooth",) * 9 + ("spin",) * 3), min_size=8, max_size=16
)


def both_driven(obstacles: list[Obstacle]) -> World:
    return World(
        left="ideal",
        length=LENGTH,
        obstacles=obstacles,
        workspace=(tuple(LOW), tuple(HIGH)),
        spacing=SPACING,
    )


def send(world: World, kind: str, rng: np.random.Generator, target: np.ndarray) -> None:
    """One chunk of a kind, towards a target that may lie anywhere."""
    here, velocity = world.cell.follower.state.positions, world.cell.follower.state.twists[:, 0]
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
            # Faster and faster up to the limit, and at rest again with the points.
            t = 0.02 * np.minimum(np.arange(len(points)), 14)
            rate = np.minimum(5.9 * t, 1.52) * np.clip(
                (len(points) - np.arange(len(points))) / 13.0, 0.0, 1.0
            )
            axis = rng.normal(size=3)
            angle = np.cumsum(rate) * 0.02
            turn = angle[:, None, None] * axis / np.linalg.norm(axis)
            now = world.cell.follower.state.orientations
            turns = poses.multiply(poses.exponential(np.repeat(turn, 2, axis=1)), now[None])
        case "stop":
            points = np.repeat(here[None], 16, axis=0)
        case "short":
            points = points[:3]
        case "sparse":
            points = points[::5]
    changes: dict = {} if turns is None else {"orientations": turns}
    if kind == "backwards":
        changes["start"] = world.now - 10_000_000_000
    if kind == "sparse":
        changes["dt"] = 0.1
    if kind == "stranger":
        changes["session"] = f"writer-{rng.integers(3)}"
    if kind == "hold":
        world.cell.take_hold("writer", world._sequence, world.now, "for a test")
        world._sequence += 1
    elif kind not in ("silence", "long_silence"):
        world.send_points(points, **changes)
    if kind == "twice":
        world._sequence -= 1
        world.send_points(points + 0.001, **changes)


def pursuit(
    here: np.ndarray, velocity: np.ndarray, target: np.ndarray, rng: np.random.Generator
) -> np.ndarray:
    """A writer without judgement: straight to the target, nearly as fast as is allowed."""
    rows, v = [here], velocity.copy()
    speed = rng.uniform(0.1, 0.6)
    for _ in range(15):
        wanted = target - rows[-1]
        far = np.maximum(np.linalg.norm(wanted, axis=1, keepdims=True), 1e-9)
        change = wanted / far * min(speed, 0.509) - v
        size = np.maximum(np.linalg.norm(change, axis=1, keepdims=True), 1e-12)
        v = v + change * np.minimum(1.0, 1.9 * 0.02 / size)
        rows.append(rows[-1] + 0.02 * v)
    return stopping(np.array(rows), 1.9)


@settings(max_examples=10, deadline=None, suppress_health_check=list(HealthCheck))
@given(kinds, st.integers(0, 2**32 - 1), st.booleans(), st.booleans())
def test_no_stream_makes_the_command_break_a_limit(
    events: list[str], seed: int, late_ball: bool, uneven: bool
) -> None:
    rng = np.random.default_rng(seed)
    world = both_driven([TABLE, POST])
    rows = [(H, world.cell.follower.state)]
    late: list[tuple[int, Obstacle]] = []
    for kind in events:
        target = aim(world.cell.follower.state, rng)
        if late_ball and not late and (ball := in_the_way(world.cell.follower.state)):
            late.append((len(rows), ball))
            world.cell.take_scene([TABLE, POST, ball])
        for _ in range(int(rng.integers(4, 24)) if kind in LASTING else int(rng.integers(1, 4))):
            send(world, kind, rng, target)
            seconds = 0.13 if kind == "long_silence" else 0.02
            rows += ticks(world, seconds, rng if uneven else None)
        if world.report.safety.needs_acknowledgement and rng.random() < 0.7:
            for action in ("acknowledge", "resume"):
                world.command(action)
                rows.append((H, world.cell.follower.state))
    check_end(world)
    rows += [(H, s) for _, s in world.states[-round(1.5 / H) :]]
    check_derivatives(rows)
    for _, state in rows:
        check_places(state)
        assert body_distance(state, POST) >= 0.012 + 0.005 - 1e-3
    for first, ball in late:
        for _, state in rows[first:]:
            assert body_distance(state, ball) >= 0.012 + 0.005 - 1e-3
    check_ways([s for _, s in rows], world.cell.follower.constraints.obstacles)


def aim(state: MotionState, rng: np.random.Generator) -> np.ndarray:
    """Targets of both ends: anywhere, behind the post, towards each other, or far apart."""
    anywhere = rng.uniform(LOW - 0.2, HIGH + 0.2, size=(2, 3))
    match int(rng.integers(6)):
        case 0:
            through = np.array(POST.position) + rng.normal(scale=0.05, size=3)
            return state.positions + 2.0 * (through - state.positions)
        case 1:
            return np.roll(state.positions, 1, axis=0)
        case 2:
            # On either side of the post, so that the rope has to go round it.
            across = np.array([[0.0, 0.25, 0.0], [0.0, -0.25, 0.0]])
            return np.array(POST.position) * [1.0, 1.0, 0.6] + across
        case 4:
            # Side by side, where only the spacing of the grips keeps them apart.
            across = np.array([0.0, *rng.normal(size=2)])
            across *= 0.4 * SPACING / np.linalg.norm(across)
            return np.mean(state.positions, axis=0) + np.array([across, -across])
        case 3:
            return state.positions + 2.0 * (state.positions - np.roll(state.positions, 1, axis=0))
        case _:
            return anywhere


def in_the_way(state: MotionState) -> Obstacle | None:
    """A ball where a fast gripper is going, as near as it can still be avoided; None without."""
    speeds = np.linalg.norm(state.twists[:, 0], axis=-1)
    end = int(np.argmax(speeds))
    if speeds[end] < 0.25:
        return None
    # Body, radius, what is kept out, the way of a stop, and a little.
    stop = speeds[end] * (0.5 * speeds[end] / LIMITS.acceleration + 0.1)
    far = 0.06 + 0.03 + 0.017 + stop + 0.02
    place = state.positions[end] + far * state.twists[end, 0] / speeds[end]
    ball = Obstacle("sphere", tuple(place.tolist()), radius=0.03, name="ball")
    return ball if body_distance(state, ball) > stop + 0.017 else None


def ticks(
    world: World, seconds: float, rng: np.random.Generator | None
) -> list[tuple[float, MotionState]]:
    """Ticks without a message, even or not: length of each step [s] and the command after it."""
    rows, end = [], world.now + round(seconds * 1e9)
    while world.now < end:
        # Kept from its core, woken too early, or its clock set back.
        tick = TICK if rng is None else int(rng.choice([TICK, TICK, 2e6, 2e7, 6e7, 0.0, -3e6]))
        world.now += tick
        world.report = world.cell.step(world.now)
        rows.append((min(max(tick * 1e-9, 0.0), LONGEST), world.cell.follower.state))
    return rows


def check_end(world: World) -> None:
    """After the stream: braking in time, rest within v/a + a/j after that; even ticks."""
    world.cell.step(world.now)
    begun, before = world.now, len(world.states)
    world.run(1.5)
    tail = world.states[before:]
    t = np.array([now - begun for now, _ in tail]) * 1e-9
    speeds = np.array([np.linalg.norm(s.twists, axis=-1) for _, s in tail])
    # The last fresh chunk came at the latest when this began, and an arm is 80 ms behind.
    braking = speeds[t >= BRAKES]
    assert np.all(np.diff(braking, axis=0) <= 1e-9), "not slower and slower in time"
    peak = np.max(speeds[t <= 0.15], axis=(0, 1))
    bounds = (
        peak[0] / LIMITS.acceleration + LIMITS.acceleration / LIMITS.jerk,
        peak[1] / LIMITS.angular_acceleration + LIMITS.angular_acceleration / LIMITS.angular_jerk,
    )
    moving = t[np.max(speeds, axis=(1, 2)) > 0.0]
    assert np.max(moving, initial=0.0) <= 0.15 + max(bounds) + 2 * H


def body_distance(state: MotionState, obstacle: Obstacle) -> float:
    """Least distance of the axes of both grippers' bodies to an obstacle [m]."""
    body = state.positions[:, None] + poses.rotate(
        state.orientations[:, None],
        np.array([[-1.0], [1.0]])[:, :, None] * np.linspace(0.0, 0.048, 20)[:, None] * [0, 0, 1],
    )
    return float(np.min(signed_distance(body, obstacle)))


def check_derivatives(rows: list[tuple[float, MotionState]]) -> None:
    """Speeds, accelerations and jerks, and that the poses move as they say."""
    h = np.array([h for h, _ in rows])[1:]
    v = np.array([s.twists for _, s in rows])
    a = np.array([s.accelerations for _, s in rows])
    for kind, (speed, acceleration, jerk) in enumerate(
        (
            (LIMITS.speed, LIMITS.acceleration, LIMITS.jerk),
            (LIMITS.angular_speed, LIMITS.angular_acceleration, LIMITS.angular_jerk),
        )
    ):
        assert np.max(np.linalg.norm(v[:, :, kind], axis=-1)) <= speed * (1.0 + 1e-6)
        assert np.max(np.linalg.norm(a[:, :, kind], axis=-1)) <= acceleration * (1.0 + 1e-6)
        change = np.linalg.norm(np.diff(a[:, :, kind], axis=0), axis=-1)
        assert np.max(change - jerk * h[:, None]) <= 1e-6 * jerk
    moved = np.diff(np.array([s.positions for _, s in rows]), axis=0)
    mean = (v[1:, :, 0] + v[:-1, :, 0]) / 2.0 * h[:, None, None]
    assert np.max(np.abs(moved - mean) - 40.0 * h[:, None, None] ** 3) <= 1e-9


def check_places(state: MotionState) -> None:
    """Workspace, obstacles, spacing and the rope's length."""
    assert np.all(state.positions >= LOW - 1e-5)
    assert np.all(state.positions <= HIGH + 1e-5)
    distance = np.linalg.norm(state.positions[1] - state.positions[0])
    assert SPACING - 1e-5 <= distance <= 0.99 * LENGTH + 1e-5


def check_ways(states: list[MotionState], obstacles: tuple[Obstacle, ...]) -> None:
    """The rope reaches round the obstacles where its ends were farthest apart."""
    spans = [float(np.linalg.norm(s.positions[1] - s.positions[0])) for s in states]
    for k in np.argsort(spans)[-3:]:
        way = shortest_path_length(*states[k].positions, obstacles)
        assert way <= 0.99 * LENGTH + 2e-3, f"{way:.4f} m round the obstacles"
