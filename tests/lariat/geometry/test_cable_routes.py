from __future__ import annotations

import numpy as np
import pytest

from lariat.geometry.cable_routes import (
    clip_openings,
    fitted_ends,
    held_clips,
    laid_chain,
    stops_of,
    tail_directions,
)
from lariat.geometry.obstacles import Obstacle
from lariat.scenario.sections import Clip

CLIP = Clip("clip", (0.1, 0.2, 0.01), opening=0.009, height=0.02, heading=30.0)
PEG = Obstacle("cylinder", (0.3, 0.3, 0.02), radius=0.01, height=0.04, support=True, name="peg")
ALONG = np.array([np.cos(np.pi / 6.0), 0.5, 0.0])
LEFT = np.array([-0.5, np.cos(np.pi / 6.0), 0.0])


def chain(left: float, up: float) -> np.ndarray:
    """Straight cable through the clip, aside from its middle and above its foot [m]."""
    middle = np.array(CLIP.position) + left * LEFT + np.array([0.0, 0.0, up])
    return middle + np.linspace(-0.1, 0.13, 24)[:, None] * ALONG


def test_a_clip_of_a_scenario_is_found_among_its_legs():
    opening = clip_openings((PEG, *CLIP.bodies))["clip"]
    np.testing.assert_allclose(opening.foot, CLIP.position, atol=1e-12)
    np.testing.assert_allclose(opening.along, ALONG, atol=1e-12)
    assert opening.half_width == pytest.approx(0.0045 + CLIP.leg_radius)
    assert opening.height == pytest.approx(CLIP.height)
    for leg in CLIP.bodies:
        assert leg.position[2] + leg.top == pytest.approx(0.01 + CLIP.height)


@pytest.mark.parametrize(
    ("left", "up", "held"),
    [
        (0.0, 0.003, True),
        (0.0014, 0.019, True),
        (0.0, 0.021, False),
        (0.008, 0.003, False),
        (-0.008, 0.003, False),
        (0.0, -0.001, False),
    ],
)
def test_a_clip_holds_what_passes_between_its_legs_below_their_tips(
    left: float, up: float, held: bool
):
    assert held_clips(["clip", "left of peg"], CLIP.bodies, chain(left, up)) == ["clip"] * held


@pytest.mark.parametrize(
    ("left", "up", "miss"),
    [
        (0.002, 0.025, "lies 5.0 mm above its tips"),
        (0.012, 0.003, "passes 12.0 mm to the left of its middle"),
        (-0.009, 0.003, "passes 9.0 mm to the right of its middle"),
    ],
)
def test_it_is_said_how_a_cable_misses_a_clip(left: float, up: float, miss: str):
    opening = clip_openings(CLIP.bodies)["clip"]
    assert opening.miss(chain(left, up)) == miss
    assert opening.miss(chain(left, up)[:10]) == "ends before it"


def test_a_cable_that_ends_before_a_clip_is_not_held():
    assert held_clips(["clip"], CLIP.bodies, chain(0.0, 0.003)[:10]) == []


@pytest.mark.parametrize(
    ("entry", "side", "end"), [("left of peg", 1.0, 0.3), ("right of peg", -1.0, 0.4)]
)
def test_a_cable_touches_the_peg_on_the_named_side(entry: str, side: float, end: float):
    ends = np.array([[0.0, 0.15, 0.03], [0.5, end, 0.03]])
    clip, peg = stops_of(["clip", entry], (PEG, *CLIP.bodies), ends, radius=0.003)
    x, y, _ = peg.place - np.array(PEG.position)
    assert np.hypot(x, y) == pytest.approx(0.013)
    assert np.sign(peg.along[0] * y - peg.along[1] * x) == side
    assert clip.place[2] == peg.place[2] == pytest.approx(0.013)


def test_a_peg_that_a_straight_cable_passes_on_the_named_side_is_no_stop():
    ends = np.array([[0.0, 0.15, 0.03], [0.5, 0.45, 0.03]])
    (clip,) = stops_of(["clip", "left of peg"], (PEG, *CLIP.bodies), ends, radius=0.003)
    assert clip.entry == "clip"
    assert len(stops_of(["clip", "right of peg"], (PEG, *CLIP.bodies), ends, radius=0.003)) == 2


def test_ends_come_nearer_to_their_stops_only_where_the_cable_is_too_short():
    ends = np.array([[0.0, 0.15, 0.03], [0.5, 0.3, 0.05]])
    stops = stops_of(["clip", "left of peg"], (PEG, *CLIP.bodies), ends, radius=0.003)
    np.testing.assert_allclose(fitted_ends(stops, ends, 0.6), ends, atol=1e-12)
    fitted = fitted_ends(stops, ends, 0.45)
    np.testing.assert_allclose(fitted[:, 2], ends[:, 2])
    points = np.array([fitted[0], *(stop.place for stop in stops), fitted[1]])
    route = float(np.sum(np.linalg.norm(np.diff(points, axis=0), axis=1)))
    assert 0.45 * 0.99 < route < 0.45
    for before, after in zip(
        tail_directions(stops, ends), tail_directions(stops, fitted), strict=True
    ):
        np.testing.assert_allclose(before, after, atol=1e-12)
    shares = np.linalg.norm((fitted - points[[1, -2]])[:, :2], axis=1)
    shares /= np.linalg.norm((ends - points[[1, -2]])[:, :2], axis=1)
    assert shares[0] == pytest.approx(shares[1])


def test_slack_lies_in_both_tails():
    ends = np.array([[0.0, 0.15, 0.03], [0.5, 0.3, 0.03]])
    stops = stops_of(["clip", "left of peg"], (PEG, *CLIP.bodies), ends, radius=0.003)
    points = np.array([ends[0], *(stop.place for stop in stops), ends[1]])
    straight = np.linalg.norm(np.diff(points, axis=0), axis=1)
    nodes, places = laid_chain(stops, ends, 1.05 * straight.sum(), 2000)
    lengths = np.diff([0.0, *places, 1.05 * straight.sum()])
    assert lengths[1] == pytest.approx(straight[1])
    assert lengths[0] / straight[0] == pytest.approx(lengths[2] / straight[2])
    assert np.min(np.linalg.norm(nodes - stops[1].place, axis=1)) < 4e-4
    with pytest.raises(ValueError, match="the cable"):
        laid_chain(stops, ends, 0.99 * straight.sum(), 20)


@pytest.mark.parametrize(
    "route", [["peg"], ["left of clip"], ["left of gone", "clip"], ["left of peg"], ["gone"]]
)
def test_a_route_of_what_is_not_there_is_refused(route: list[str]):
    with pytest.raises(ValueError, match="route"):
        stops_of(route, (PEG, *CLIP.bodies), np.zeros((2, 3)), radius=0.003)
