from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lariat.geometry import poses
from lariat.geometry.poses import Pose
from lariat.safety.motion import validation
from lariat.safety.motion.validation import ChunkRefused, ChunkTolerances, check_length
from lariat.trajectory import MotionState, SetpointChunk, Spline
from tests.services.robot_gateway.cells import LIMITS

NOW = 1_000_000_000
TOLERANCES = ChunkTolerances()
DT = 0.02


def chunk(
    x: np.ndarray | None = None,
    *,
    start: int = NOW,
    dt: float = DT,
    angles: np.ndarray | None = None,
) -> SetpointChunk:
    """Setpoints of one end along the x axis, turned about it; at rest by default."""
    x = np.zeros(16) if x is None else x
    positions = np.zeros((len(x), 1, 3))
    positions[:, 0, 0] = x
    angles = np.zeros(len(x)) if angles is None else angles
    orientations = poses.exponential(angles[:, None] * np.array([1.0, 0.0, 0.0]))[:, None]
    return SetpointChunk(start, dt, positions, orientations)


def refusal(check: object, *arguments: object) -> str:
    """Rule by which a check refuses; empty where it does not."""
    try:
        check(*arguments)  # pyright: ignore
    except ChunkRefused as refused:
        return refused.rule
    return ""


def finite(made: SetpointChunk, ends: int = 1) -> str:
    return refusal(validation.check_finite, made, ends, TOLERANCES)


def fresh(made: SetpointChunk, now: int = NOW, offset: int = 0) -> str:
    return refusal(validation.check_fresh, made, now, offset, TOLERANCES)


def limits(made: SetpointChunk, now: int = NOW) -> str:
    spline = Spline(made, made.start)
    return refusal(validation.check_limits, spline, now, LIMITS, TOLERANCES)


def step(made: SetpointChunk) -> str:
    state = MotionState.at_rest(Pose(np.zeros(3), poses.IDENTITY))
    return refusal(validation.check_step, Spline(made, made.start), NOW, state, TOLERANCES)


def stretched(profile: np.ndarray, duration: float) -> np.ndarray:
    """A profile over 0…1 at setpoints, with two more at its end so that it comes to rest."""
    count = round(duration / DT) + 1
    x = np.interp(np.linspace(0.0, 1.0, count), np.linspace(0.0, 1.0, len(profile)), profile)
    return np.concatenate([x, x[-1:], x[-1:]])


S = np.linspace(0.0, 1.0, 2001)
SMOOTH = S**3 * (10.0 - 15.0 * S + 6.0 * S**2)
"""Quintic from rest to rest: speed 1.875, acceleration 5.77, jerk 60 per unit of duration."""


def test_resting_chunk_is_accepted_by_every_check() -> None:
    assert (finite(chunk()), fresh(chunk()), limits(chunk()), step(chunk())) == ("",) * 4


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf, 1.1e3])
def test_position_that_is_no_place_is_not_finite(bad: float) -> None:
    x = np.zeros(16)
    x[7] = bad
    assert finite(chunk(x)) == "finite"


def test_chunk_of_too_many_poses_or_too_long_a_span_is_refused() -> None:
    check_length(chunk(np.zeros(TOLERANCES.poses)), TOLERANCES)
    for count, dt in ((TOLERANCES.poses + 1, 0.02), (12, 0.2)):
        with pytest.raises(ChunkRefused, match=r"finite.*40 poses"):
            check_length(replace(chunk(np.zeros(count)), dt=dt), TOLERANCES)


def test_shape_that_does_not_fit_the_ends_is_not_finite() -> None:
    assert finite(chunk(), ends=2) == "finite"
    assert finite(chunk(np.zeros(1))) == "finite"
    assert finite(chunk(np.zeros(2))) == ""


@pytest.mark.parametrize(("norm", "rule"), [(1.0009, ""), (0.9991, ""), (1.0011, "finite")])
def test_quaternion_has_unit_norm(norm: float, rule: str) -> None:
    made = chunk()
    scaled = SetpointChunk(made.start, made.dt, made.positions, norm * made.orientations)
    assert finite(scaled) == rule


@pytest.mark.parametrize(
    ("dt", "rule"), [(0.002, ""), (0.2, ""), (0.0019, "finite"), (0.21, "finite"), (0.0, "finite")]
)
def test_dt_is_within_its_bounds(dt: float, rule: str) -> None:
    assert finite(chunk(dt=dt)) == rule


@pytest.mark.parametrize(
    ("age", "rule"),
    [(0.0, ""), (0.25, ""), (-0.25, ""), (0.251, "fresh"), (-0.251, "fresh")],
)
def test_first_pose_is_near_the_present(age: float, rule: str) -> None:
    start = NOW - round(age * 1e9)
    assert fresh(chunk(start=start)) == rule
    # The same by the clock of a writer that is an hour ahead.
    offset = -3_600_000_000_000
    assert fresh(chunk(start=start - offset), offset=offset) == rule


@pytest.mark.parametrize(("count", "rule"), [(14, ""), (13, ""), (12, "rest")])
def test_chunk_spans_a_quarter_of_a_second_within_one_dt(count: int, rule: str) -> None:
    assert fresh(chunk(np.zeros(count))) == rule


@pytest.mark.parametrize(("share", "rule"), [(0.9, ""), (1.01, ""), (1.1, "speed")])
def test_speed_is_bounded_with_its_tolerance(share: float, rule: str) -> None:
    distance = 1.0
    assert limits(chunk(stretched(distance * SMOOTH, 1.875 * distance / (share * 0.5)))) == rule


@pytest.mark.parametrize(("share", "rule"), [(0.9, ""), (1.4, ""), (1.6, "acceleration")])
def test_acceleration_is_bounded_with_its_tolerance(share: float, rule: str) -> None:
    duration = 0.4
    distance = share * 2.0 * duration**2 / 5.7735
    assert limits(chunk(stretched(distance * SMOOTH, duration))) == rule


@pytest.mark.parametrize(("share", "rule"), [(0.9, ""), (1.1, "jerk")])
def test_jerk_is_bounded_with_its_tolerance(share: float, rule: str) -> None:
    # A single setpoint beside the others has a third difference of three times its distance.
    x = np.zeros(20)
    x[10] = share * 10.0 * LIMITS.jerk * DT**3 / 3.0
    assert 2.0 * x[10] / DT**2 < 200.0 * LIMITS.acceleration
    loose = ChunkTolerances(acceleration=1e3)
    made = chunk(x)
    assert refusal(validation.check_limits, Spline(made, NOW), NOW, LIMITS, loose) == rule


def test_rotation_has_limits_of_its_own() -> None:
    assert limits(chunk(np.zeros(153), angles=stretched(1.0 * SMOOTH, 3.0))) == ""
    assert limits(chunk(np.zeros(53), angles=stretched(1.0 * SMOOTH, 1.0))) == "speed"


@pytest.mark.parametrize(("share", "rule"), [(0.99, ""), (1.01, "rest")])
def test_last_poses_are_at_rest_within_one_step_of_deceleration(share: float, rule: str) -> None:
    x = np.zeros(20)
    x[-1] = share * 1.5 * LIMITS.acceleration * DT**2
    loose = ChunkTolerances(jerk=1e3)
    made = chunk(x)
    assert refusal(validation.check_limits, Spline(made, NOW), NOW, LIMITS, loose) == rule


def test_what_is_past_is_not_judged_any_more() -> None:
    x = np.zeros(40)
    x[:3] = [0.1, 0.05, 0.0]
    assert limits(chunk(x)) != ""
    assert limits(chunk(x), now=NOW + 200_000_000) == ""


def test_refusal_names_its_rule_first() -> None:
    with pytest.raises(ChunkRefused, match=r"^rest: spans 0\.020 s"):
        validation.check_fresh(chunk(np.zeros(2)), NOW, 0, TOLERANCES)


@pytest.mark.parametrize(("distance", "rule"), [(0.0299, ""), (0.0301, "step")])
def test_chunk_takes_over_near_the_commanded_position(distance: float, rule: str) -> None:
    assert step(chunk(np.full(16, distance))) == rule


@pytest.mark.parametrize(("angle", "rule"), [(0.199, ""), (0.201, "step")])
def test_chunk_takes_over_near_the_commanded_orientation(angle: float, rule: str) -> None:
    assert step(chunk(angles=np.full(16, angle))) == rule
