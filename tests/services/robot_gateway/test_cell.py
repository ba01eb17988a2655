from __future__ import annotations

import numpy as np
import pytest

from lariat.geometry import poses
from lariat.geometry.obstacles import TABLE, Obstacle
from tests.services.robot_gateway.cells import ALONG_X, START, World, smooth_step

REST = np.array([[0.2, 0.0, 0.3]])


def sideways(t: float) -> np.ndarray:
    return REST + smooth_step(t, 2.0) * np.array([[-0.1, 0.15, 0.05]])


def resting_points(at: np.ndarray = REST, count: int = 16) -> np.ndarray:
    return np.repeat(at[None], count, axis=0)


def test_smooth_chunks_are_followed_within_a_tenth_of_a_millimetre() -> None:
    world = World()
    since = world.now
    world.follow(sideways, 2.5, since)
    errors = [
        np.max(np.abs(state.positions - sideways((now - since) * 1e-9)))
        for now, state in world.states[5:]
    ]
    assert max(errors) < 1e-4
    assert world.report.safety.mode in ("moving", "armed")
    assert world.report.rule is None


def test_silence_brakes_within_150_ms_and_rest_comes_in_time() -> None:
    world = World()
    world.follow(lambda t: REST + np.array([[0.0, 0.2 * t**2, 0.0]]), 0.7)
    last = world.now
    peak = 0.0
    while world.now < last + round(1e9):
        world.step()
        speed = np.linalg.norm(world.cell.follower.state.twists[0, 0])
        if world.now <= last + round(0.15e9):
            peak = max(peak, speed)
        elif world.now <= last + round(0.16e9):
            assert speed < peak, "not slower 150 ms after the last fresh chunk"
        if world.cell.follower.resting:
            break
    assert (world.now - last) * 1e-9 <= 0.15 + peak / 2.0 + 2.0 / 40.0
    report = world.step()
    assert (report.safety.mode, report.safety.cause, report.rule) == ("holding", "silence", "fresh")
    assert report.safety.needs_acknowledgement


def test_a_simulated_cell_goes_on_by_itself_after_silence() -> None:
    world = World(simulated=True)
    path = lambda t: REST + np.array([[0.0, 0.1 * t**2, 0.0]])  # noqa: E731
    world.follow(path, 0.5)
    world.run(0.5)
    safety = world.report.safety
    assert (safety.mode, safety.cause, safety.needs_acknowledgement) == ("holding", "slow", False)
    assert world.report.pauses == 1
    assert world.cell.follower.resting
    here = world.cell.follower.state.positions
    world.follow(lambda t: here + np.array([[0.0, 0.1 * t**2, 0.0]]), 0.5)
    assert world.report.safety.mode == "moving"


def test_a_person_who_holds_a_slow_simulated_cell_is_waited_for() -> None:
    world = World(simulated=True)
    world.follow(lambda t: REST + np.array([[0.0, 0.1 * t**2, 0.0]]), 0.5)
    world.run(0.12)
    assert world.report.safety.cause == "slow"
    assert world.command("hold") == ""
    here = world.cell.follower.state.positions
    world.run(0.3)
    world.follow(lambda t: here + np.array([[0.0, 0.1 * t**2, 0.0]]), 0.3)
    assert world.report.safety.cause == "person"
    assert world.report.safety.needs_acknowledgement


def test_silence_is_reported_even_if_braking_has_already_ended() -> None:
    world = World()
    # Slow enough to be at rest again before the 100 ms of silence are over.
    world.follow(lambda t: REST + np.array([[0.0, 0.005 * t**2, 0.0]]), 0.3)
    last = world.now
    assert world.report.safety.mode == "moving"
    rested = None
    while world.now < last + round(0.2e9):
        world.step()
        if rested is None and world.cell.follower.resting:
            rested = (world.now - last) * 1e-9
    assert rested is not None
    assert rested < 0.1
    safety = world.report.safety
    assert (safety.mode, safety.cause, safety.needs_acknowledgement) == ("holding", "silence", True)


def test_command_begins_to_brake_before_an_arm_that_lags_must() -> None:
    world = World()
    world.follow(lambda t: REST + np.array([[0.0, 0.2 * t**2, 0.0]]), 0.7)
    before = len(world.states)
    world.run(0.3)
    speeds = [np.linalg.norm(s.twists[0, 0]) for _, s in world.states[before:]]
    # 50 ms after the last chunk, which came a little before.
    assert np.argmax(speeds) * 0.008 <= 0.05


def test_new_writer_holds_until_a_person_acknowledges() -> None:
    world = World()
    since = world.now
    world.follow(sideways, 2.1, since, session="first")
    world.run(0.6)
    assert world.report.safety.mode == "armed"
    world.send(sideways, since, session="second")
    report = world.step()
    assert (report.safety.mode, report.safety.cause) == ("holding", "new_writer")
    at = world.cell.follower.state.positions
    world.follow(lambda t: at, 0.2, session="second")
    np.testing.assert_array_equal(world.cell.follower.state.positions, at)
    world.go_on()
    world.follow(
        lambda t: at + np.array([[0.0, 0.1 * smooth_step(t, 1.0), 0.0]]), 1.2, session="second"
    )
    assert np.isclose(world.cell.follower.state.positions[0, 1], at[0, 1] + 0.1, atol=1e-3)


def test_stop_of_an_earlier_start_and_after_its_expiry_is_obeyed() -> None:
    world = World()
    assert world.command("hold", boot="gateway-of-yesterday", answers=START) == ""
    assert world.report.safety.mode == "holding"
    assert world.command("disarm", boot="", answers=0) == ""
    assert world.report.safety.mode == "disarmed"


def test_a_person_arms_and_only_with_this_boot_and_in_time() -> None:
    world = World(automatic=False)
    world.send_points(resting_points())
    assert world.step().safety.mode == "disarmed"
    assert "boot" in world.command("arm", boot="gateway-of-yesterday")
    assert "s old" in world.command("arm", answers=START - 10**9)
    assert world.report.safety.mode == "disarmed"
    assert world.command("arm") == ""
    assert world.report.safety.mode == "armed"
    assert "armed already" in world.command("arm")
    world.command("hold")
    assert "disarm or acknowledge first" in world.command("arm")


@pytest.mark.parametrize(
    ("rule", "points", "changes"),
    [
        ("finite", resting_points(np.full((1, 3), np.nan)), {}),
        ("finite", resting_points(np.full((1, 3), np.inf)), {}),
        ("finite", resting_points(), {"dt": 0.0}),
        ("finite", resting_points(), {"orientations": np.full((16, 1, 4), 0.9)}),
        ("finite", np.zeros((16, 2, 3)), {}),
        ("fresh", resting_points(), {"start": START + 10 * START}),
        ("rest", resting_points(count=4), {}),
        ("rest", REST + np.arange(16)[:, None, None] * np.array([[[0.0, 0.006, 0.0]]]), {}),
        ("speed", REST + np.minimum(np.arange(20), 10)[:, None, None] * 0.02, {}),
        ("acceleration", REST + ((np.arange(16) > 8) * 0.004)[:, None, None], {}),
        ("step", resting_points(REST + 0.05), {}),
        ("ordered", resting_points(), {"sequence": 0}),
        ("ordered", resting_points(), {"session": ""}),
    ],
)
def test_bad_chunk_is_refused_whole_with_its_rule(
    rule: str, points: np.ndarray, changes: dict
) -> None:
    world = World()
    world.send_points(resting_points())
    world.step()
    before = world.report.sequence
    world.send_points(points, **changes)
    report = world.step()
    assert report.rule == rule, report.refusal
    assert report.sequence == before
    np.testing.assert_array_equal(world.cell.follower.state.positions, REST)


def slow_way(to: np.ndarray) -> np.ndarray:
    """Poses from rest at the start to rest at another place in three seconds."""
    return np.array([REST + smooth_step(0.02 * k, 3.0) * (to - REST) for k in range(152)])


@pytest.mark.parametrize(
    ("rule", "to", "obstacles"),
    [
        ("workspace", [[0.2, -0.3, 0.3]], [TABLE]),
        ("table", [[0.2, 0.0, 0.02]], [Obstacle("half_space", (0.0, 0.0, 0.015))]),
        ("keep_out", [[0.2, 0.2, 0.3]], [TABLE, Obstacle("sphere", (0.2, 0.2, 0.3), radius=0.05)]),
        ("spacing", [[-0.19, 0.0, 0.3]], [TABLE]),
        ("overstretch", [[0.397, 0.0, 0.3]], [TABLE]),
        # Round the post the way is longer than straight through it.
        (
            "overstretch",
            [[0.37, 0.0, 0.3]],
            [TABLE, Obstacle("cylinder", (0.0, 0.0, 0.3), radius=0.12, height=2.0)],
        ),
    ],
)
def test_path_across_a_boundary_is_refused_by_its_rule(
    rule: str, to: list, obstacles: list
) -> None:
    world = World(obstacles=obstacles, workspace=((-0.8, -0.25, 0.01), (0.8, 0.8, 1.2)))
    world.send_points(slow_way(np.array(to)))
    assert world.step().rule == rule, world.report.refusal


def test_path_out_of_a_region_is_refused_whatever_the_scene_says() -> None:
    region = Obstacle("box", (0.0, 0.0, 0.3), size=(0.8, 0.4, 0.4), keep_in=True, name="tray")
    world = World(regions=(region,))
    world.cell.take_scene([])
    world.send_points(slow_way(np.array([[0.2, 0.19, 0.3]])))
    assert world.step().rule is None, world.report.refusal
    world = World(regions=(region,))
    world.cell.take_scene([])
    world.send_points(slow_way(np.array([[0.2, 0.21, 0.3]])))
    assert world.step().rule == "keep_in", world.report.refusal


@pytest.mark.parametrize(
    "wall",
    [
        Obstacle("box", (0.2, 0.32, 0.3), size=(0.4, 0.02, 0.4), name="wall"),
        Obstacle("cylinder", (0.2, 0.34, 0.3), radius=0.03, height=0.4, name="post"),
        Obstacle("sphere", (0.2, 0.34, 0.3), radius=0.03, name="ball"),
    ],
    ids=lambda wall: wall.shape,
)
def test_obstacle_that_appears_in_the_way_stops_the_gripper_before_it(wall: Obstacle) -> None:
    world = World()
    since = world.now
    ahead = lambda t: REST + np.array([[0.0, 0.35 * smooth_step(t, 2.0), 0.0]])  # noqa: E731
    world.follow(ahead, 0.8, since)
    world.cell.take_scene([TABLE, wall])
    world.follow(ahead, 1.5, since)
    assert world.cell.follower.state.positions[0, 1] + 0.012 + 0.005 <= 0.31
    assert world.cell.follower.resting
    # What is asked for lies beyond the obstacle by now, a step too far and too long a way round.
    assert world.report.rule in ("keep_out", "step", "overstretch")


def test_rope_that_is_too_tight_may_only_be_relieved() -> None:
    world = World(length=0.4)
    tighter = np.array(
        [REST + smooth_step(0.02 * k, 1.0) * np.array([[0.005, 0.0, 0.0]]) for k in range(60)]
    )
    world.send_points(tighter)
    assert world.step().rule == "overstretch"
    since = world.now
    world.follow(lambda t: REST - np.array([[0.05 * smooth_step(t, 1.0), 0.0, 0.0]]), 1.2, since)
    assert np.isclose(world.cell.follower.state.positions[0, 0], 0.15, atol=1e-3)


def test_reset_waits_for_rest_and_returns_to_the_start() -> None:
    world = World()
    world.follow(sideways, 1.0)
    world.cell.take_reset(1)
    world.cell.take_reset(2)
    report = world.step()
    assert report.reset_count == 1
    report = world.run(0.5)
    assert report.reset_count == 2
    np.testing.assert_array_equal(world.cell.follower.state.positions, REST)
    world.follow(sideways, 0.2)
    assert world.report.safety.mode == "moving"


def test_gateway_takes_over_the_count_of_resets_without_a_reset() -> None:
    world = World()
    world.follow(sideways, 1.0)
    world.cell.take_reset(7)
    report = world.step()
    assert report.reset_count == 7
    assert report.safety.mode == "moving"
    world.cell.take_reset(0)
    world.cell.take_reset(7)
    assert world.step().safety.mode == "moving"


def test_writer_that_holds_stops_the_arm_and_goes_on_by_itself() -> None:
    world = World()
    world.follow(sideways, 0.8)
    world.cell.take_hold("writer", world._sequence, world.now, "paused by a person")
    world._sequence += 1
    report = world.run(0.5)
    assert (report.safety.mode, report.safety.detail) == ("holding", "paused by a person")
    assert world.cell.follower.resting
    at = world.cell.follower.state.positions
    world.follow(lambda t: at, 0.1)
    assert world.report.safety.mode == "moving"


def test_silence_during_a_rotation_in_place_is_reported() -> None:
    world = World()
    axis = np.array([0.0, 0.0, 1.0])
    # The position is right all the time, and the turn slow enough to be at rest again before the
    # 100 ms of silence are over.
    angles = 0.1 * np.array([smooth_step(0.02 * k, 1.6) for k in range(81)])
    turns = poses.multiply(poses.exponential(angles[:, None] * axis), ALONG_X)
    world.send_points(resting_points(count=81), orientations=turns[:, None])
    world.run(0.3)
    assert world.cell.follower.resting
    safety = world.report.safety
    assert (safety.mode, safety.cause, safety.needs_acknowledgement) == ("holding", "silence", True)


def test_silence_before_a_closed_path_is_reported() -> None:
    world = World()
    # To and fro by 10 mm, so slowly at first that nothing has moved when the silence begins.
    there = [smooth_step(0.02 * k, 1.0) - smooth_step(0.02 * k - 1.0, 1.0) for k in range(102)]
    world.send_points(REST + np.array(there)[:, None, None] * np.array([[0.0, 0.01, 0.0]]))
    world.run(0.2)
    safety = world.report.safety
    assert (safety.mode, safety.cause) == ("holding", "silence")
