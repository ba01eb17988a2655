from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lariat.geometry import poses
from lariat.geometry.grippers import gripper_bodies
from lariat.geometry.obstacles import TABLE, Obstacle
from lariat.geometry.poses import Pose
from lariat.safety.constraints.motion_constraints import CellBoundaries
from lariat.safety.motion.follower import SetpointFollower
from lariat.safety.motion.validation import ChunkRefused, gap
from lariat.scenario.sections import Limits
from lariat.trajectory import SetpointChunk
from tests.services.robot_gateway.cells import ALONG_X, LIMITS, smooth_step

NOW = 1_000_000_000
TICK = 8_000_000
REST = np.array([0.2, 0.0, 0.3])
STARTS = (Pose(np.array([-0.2, 0.0, 0.3]), ALONG_X), Pose(REST, ALONG_X))
BOUNDARIES = CellBoundaries(
    0.6, ((-0.8, -0.8, 0.01), (0.8, 0.8, 1.2)), gripper_bodies(0.048, 0.012)
)


def follower(*obstacles: Obstacle, limits: Limits = LIMITS) -> SetpointFollower:
    """A follower whose left end is fixed."""
    made = SetpointFollower(limits, BOUNDARIES, STARTS, driven=[1])
    made.constraints.replace_obstacles([TABLE, *obstacles])
    return made


def chunk(to: tuple[float, float, float], seconds: float = 1.0) -> SetpointChunk:
    """Smooth motion of the right grip from its start to another place."""
    times = 0.02 * np.arange(round(seconds / 0.02) + 3)
    share = np.array([smooth_step(t, seconds) for t in times])[:, None, None]
    positions = REST + share * (np.array([[to]]) - REST)
    orientations = np.broadcast_to(ALONG_X, (*positions.shape[:-1], 4)).copy()
    return SetpointChunk(NOW, 0.02, positions, orientations)


def rotation(angle: float, seconds: float) -> SetpointChunk:
    """Smooth rotation of the right grip about the vertical."""
    times = 0.02 * np.arange(round(seconds / 0.02) + 3)
    share = np.array([smooth_step(t, seconds) for t in times])[:, None, None]
    turned = poses.exponential(angle * share * np.array([0.0, 0.0, 1.0]))
    orientations = poses.multiply(turned, np.broadcast_to(ALONG_X, turned.shape))
    return SetpointChunk(NOW, 0.02, np.broadcast_to(REST, (len(times), 1, 3)).copy(), orientations)


def stepped(made: SetpointFollower, seconds: float, brake: bool = False) -> list[str | None]:
    """Rules that slowed the command, tick by tick from `NOW`."""
    count = round(seconds * 1e9) // TICK
    return [made.step(NOW + k * TICK, NOW + (k + 1) * TICK, brake) for k in range(count)]


def test_follower_begins_at_rest_where_the_grips_are() -> None:
    made = follower()
    assert made.resting
    assert not made.following
    np.testing.assert_array_equal(made.state.positions, [REST])


def test_checked_chunk_is_followed_to_its_resting_end() -> None:
    made = follower()
    made.follow(made.check(chunk((0.2, 0.1, 0.3)), NOW), NOW)
    assert made.following
    assert not any(stepped(made, 1.3))
    np.testing.assert_allclose(made.state.positions, [[0.2, 0.1, 0.3]], atol=1e-4)
    assert made.finished(NOW + 1_300_000_000)


def test_chunk_across_an_obstacle_is_refused_by_name_and_nothing_is_followed() -> None:
    made = follower(Obstacle("sphere", (0.2, 0.1, 0.3), radius=0.03))
    with pytest.raises(ChunkRefused, match=r"keep_out.*0\.0") as refused:
        made.check(chunk((0.2, 0.1, 0.3)), NOW)
    assert refused.value.rule == "keep_out"
    assert not made.following


def test_chunk_keeps_a_margin_that_the_tick_does_not_need() -> None:
    # The body is covered by spheres of 13.4 mm, and keeps out 5 mm.
    radius = float(np.hypot(0.012, 0.006))
    low = 0.3 - radius
    for slack, refused in ((0.0016, False), (0.0014, True)):
        made = follower(Obstacle("half_space", (0.0, 0.0, low - 0.1 - slack)))
        down = chunk((0.2, 0.0, 0.2))
        if refused:
            with pytest.raises(ChunkRefused, match="table"):
                made.check(down, NOW)
        else:
            made.check(down, NOW)


def test_obstacle_that_appears_ahead_is_named_and_the_command_brakes_before_it() -> None:
    made = follower()
    made.follow(made.check(chunk((0.2, 0.2, 0.3)), NOW), NOW)
    made.constraints.replace_obstacles([TABLE, Obstacle("sphere", (0.2, 0.2, 0.3), radius=0.05)])
    rules = stepped(made, 1.5)
    assert "keep_out" in rules
    assert made.resting
    assert made.state.positions[0, 1] <= 0.2 - 0.05 - 0.005 - 0.012


def test_halt_ends_in_the_stop_that_was_checked() -> None:
    made = follower()
    made.follow(made.check(chunk((0.2, 0.2, 0.3)), NOW), NOW)
    stepped(made, 0.5)
    speed = np.linalg.norm(made.state.twists[0, 0])
    made.halt()
    assert not made.following
    stepped(made, speed / LIMITS.acceleration + LIMITS.acceleration / LIMITS.jerk + 0.1)
    assert made.resting


def test_braking_keeps_the_chunk_so_that_the_next_one_takes_over() -> None:
    made = follower()
    made.follow(made.check(chunk((0.2, 0.2, 0.3)), NOW), NOW)
    stepped(made, 0.5)
    before = np.linalg.norm(made.state.twists[0, 0])
    made.step(NOW + 500_000_000, NOW + 580_000_000, brake=True)
    assert np.linalg.norm(made.state.twists[0, 0]) < before
    assert made.following


@pytest.mark.parametrize("compiled", [False, True])
@pytest.mark.parametrize(("acceleration", "seconds"), [(6.0, 1.0), (0.7, 2.43)])
def test_command_that_fell_behind_a_rotation_catches_up_and_stays(
    acceleration: float, seconds: float, compiled: bool
) -> None:
    limits = replace(LIMITS, angular_acceleration=acceleration, angular_jerk=15.0 * acceleration)
    made = follower(limits=limits)
    if compiled:
        made.compile()
    turning = made._spline(rotation(0.7, seconds), NOW)
    angles = []
    for k in range(600):
        now = NOW + k * TICK
        if k % 3 == 0:
            made.follow(turning, now)
        made.step(now, now + TICK, brake=60 <= k < 75)
        angles.append(gap(made.state, turning(now + TICK))[1])
    assert max(angles) < 0.14
    assert max(angles[450:]) < 1e-3


def test_lag_is_the_distance_from_the_chunk() -> None:
    made = follower()
    assert made.lag(NOW) == (0.0, 0.0)
    made.follow(made.check(chunk((0.2, 0.2, 0.3)), NOW), NOW)
    distance, angle = made.lag(NOW + 2_000_000_000)
    assert np.isclose(distance, 0.2)
    assert angle < 1e-9


def test_chunk_that_has_not_begun_to_move_has_not_arrived() -> None:
    made = follower()
    made.follow(made.check(chunk((0.2, 0.02, 0.3)), NOW), NOW)
    assert not made.arrived(NOW)
    assert not made.finished(NOW)
