from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import minimize

from lariat.geometry.obstacles import TABLE, Obstacle
from lariat.safety.constraints import rope_length
from lariat.safety.constraints.obstacle_scene import ObstacleScene
from lariat.safety.constraints.rope_length import RopeLengthConstraint
from lariat.safety.constraints.shortest_path import PathSearch, shortest_path_length
from lariat.safety.constraints.slacks import first_broken
from lariat.safety.constraints.spacing import grip_distances

POST = Obstacle("cylinder", (0.0, 0.0, 0.3), radius=0.1, height=4.0)
BESIDE = Obstacle("sphere", (0.0, 0.0, 2.0), radius=0.1, name="beside")


def grips(*half_distances: float) -> np.ndarray:
    return np.array([[[-x, 0.0, 0.3], [x, 0.0, 0.3]] for x in half_distances])


def slack(constraint: RopeLengthConstraint, positions: np.ndarray) -> np.ndarray:
    """Slack by finished searches."""
    with constraint.finishing_searches():
        return constraint.slack(positions, grip_distances(positions))


def hurried_slack(constraint: RopeLengthConstraint, positions: np.ndarray) -> np.ndarray:
    """Slack as a tick of the gateway computes it."""
    return constraint.slack(positions, grip_distances(positions))


@pytest.fixture
def searches(monkeypatch: pytest.MonkeyPatch) -> list[object]:
    """The searches that have begun."""
    begun = []

    def counted(*arguments: object) -> PathSearch:
        begun.append(arguments)
        return PathSearch(*arguments)  # pyright: ignore

    monkeypatch.setattr(rope_length, "PathSearch", counted)
    return begun


@pytest.mark.parametrize("expected", [0.2, 0.0, -0.01], ids=["kept", "boundary", "broken"])
def test_free_rope_may_be_as_long_as_the_straight_distance(expected: float) -> None:
    constraint = RopeLengthConstraint(0.5)
    positions = grips((0.5 - expected) / 2.0)
    np.testing.assert_allclose(slack(constraint, positions), [expected], atol=1e-15)


def test_obstacle_between_the_grips_makes_the_path_longer() -> None:
    constraint = RopeLengthConstraint(0.62)
    positions = grips(0.3)
    assert slack(constraint, positions)[0] > 0.0
    constraint.replace_scene(ObstacleScene([TABLE, POST]))
    length = shortest_path_length(*positions[0], [TABLE, POST])
    assert length > 0.62
    np.testing.assert_allclose(slack(constraint, positions), [0.62 - length])


def round_the_post(half_distance: float) -> float:
    """Length of the shortest path round `POST`: two tangents and an arc."""
    radius = POST.radius
    tangents = 2.0 * np.sqrt(half_distance**2 - radius**2)
    return tangents + 2.0 * radius * np.arcsin(radius / half_distance)


def test_slack_is_never_overestimated_where_paths_are_remembered() -> None:
    constraint = RopeLengthConstraint(0.72)
    constraint.replace_scene(ObstacleScene([TABLE, POST]))
    halves = np.linspace(0.25, 0.33, 9)
    exact = np.array([0.72 - round_the_post(half) for half in halves])
    found = slack(constraint, grips(*halves))
    assert np.all(found <= exact + 5e-4)
    assert np.all(found >= exact - 1e-3)


def test_remembered_paths_spare_a_search(searches: list[object]) -> None:
    constraint = RopeLengthConstraint(0.9)
    constraint.replace_scene(ObstacleScene([TABLE, POST]))
    slack(constraint, grips(0.3))
    slack(constraint, grips(0.301, 0.302))
    assert len(searches) == 1


@pytest.mark.parametrize(
    ("obstacles", "count"),
    [
        ([POST, BESIDE], 1),
        ([POST], 1),
        ([POST, Obstacle("box", (0.0, 0.0, 0.3), size=(0.01, 0.5, 4.0), name="in the way")], 2),
    ],
    ids=["one comes elsewhere", "all stay", "one comes into the path"],
)
def test_new_scene_forgets_only_the_paths_that_it_cuts(
    searches: list[object], obstacles: list[Obstacle], count: int
) -> None:
    constraint = RopeLengthConstraint(0.9)
    constraint.replace_scene(ObstacleScene([TABLE, POST]))
    slack(constraint, grips(0.3))
    constraint.replace_scene(ObstacleScene(obstacles))
    slack(constraint, grips(0.3))
    assert len(searches) == count


def test_what_is_not_known_yet_breaks_the_rule_also_beside_an_unknown_present() -> None:
    constraint = RopeLengthConstraint(0.9)
    constraint.replace_scene(ObstacleScene([TABLE, POST]))
    positions = grips(0.3, 0.3)
    found = np.zeros(0)
    for _ in range(3):
        found = hurried_slack(constraint, positions)
        assert constraint.searching
        assert first_broken({"overstretch": found}) is not None
    while constraint.searching:
        found = hurried_slack(constraint, positions)
    assert first_broken({"overstretch": found}) is None
    np.testing.assert_allclose(found, slack(constraint, positions))


def test_path_is_searched_before_the_known_ones_do_not_suffice() -> None:
    constraint = RopeLengthConstraint(0.68)
    constraint.replace_scene(ObstacleScene([TABLE, POST]))
    slack(constraint, grips(0.25))
    # Both grips rise by 0.4 m/s, evaluated once in a tick of 8 ms.
    step = np.array([0.0, 0.0, 0.0032])
    for k in range(120):
        found = hurried_slack(
            constraint, np.concatenate([grips(0.25) + (k + i) * step for i in (0, 1)])
        )
        assert first_broken({"overstretch": found}) is None


def test_taut_rope_is_followed_by_joining_known_paths() -> None:
    length = shortest_path_length(*grips(0.25)[0], [TABLE, POST])
    constraint = RopeLengthConstraint(length + 0.008)
    constraint.replace_scene(ObstacleScene([TABLE, POST]))
    slack(constraint, grips(0.25))
    # 5 mm from one evaluation to the next is more than 8 mm of slack allow for two of them.
    step = np.array([0.0, 0.0, 0.005])
    for k in range(20):
        positions = np.concatenate([grips(0.25) + (k + i) * step for i in (0, 1)])
        assert first_broken({"overstretch": hurried_slack(constraint, positions)}) is None


def test_scene_full_of_obstacles_takes_no_more_work_at_once(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    evaluated = []
    find = rope_length.PathSearch.advance
    monkeypatch.setattr(
        rope_length.PathSearch,
        "advance",
        lambda self, steps: evaluated.append(steps) or find(self, steps),
    )
    rng = np.random.default_rng(0)
    posts = [
        Obstacle("box", tuple(rng.uniform([-0.2, -0.1, 0.2], [0.2, 0.1, 0.4])), size=(0.05,) * 3)
        for _ in range(256)
    ]
    constraint = RopeLengthConstraint(0.9)
    constraint.replace_scene(ObstacleScene([TABLE, *posts]))
    hurried_slack(constraint, grips(0.3, 0.31, 0.32))
    assert sum(evaluated) == rope_length.SEARCH_STEPS


def test_rope_that_is_too_tight_already_may_not_get_tighter() -> None:
    constraint = RopeLengthConstraint(0.62)
    constraint.replace_scene(ObstacleScene([TABLE, POST]))
    assert first_broken({"overstretch": slack(constraint, grips(0.3, 0.29))}) is None
    assert first_broken({"overstretch": slack(constraint, grips(0.29, 0.3))}) is not None


def test_straight_lines_through_a_slit_are_known_without_a_search(searches: list[object]) -> None:
    constraint = RopeLengthConstraint(0.45)
    walls = tuple(
        Obstacle("box", (side * 0.508, 0.0, z), size=(1.0, 0.03, 0.2), name=f"wall{side:+g}-{z:g}")
        for side in (-1.0, 1.0)
        for z in (0.1, 0.3, 0.5, 0.7, 0.9, 1.1)
    )
    constraint.replace_scene(ObstacleScene(walls))
    way = np.linspace(-0.3, 0.3, 40)
    ends = [[[0.0, y - 0.215, 0.4], [0.0, y + 0.215, 0.4]] for y in way]
    np.testing.assert_allclose(hurried_slack(constraint, np.array(ends)), 0.02, atol=1e-9)
    assert not searches


def test_path_known_on_one_side_of_an_obstacle_bounds_nothing_on_the_other() -> None:
    constraint = RopeLengthConstraint(0.55)
    constraint.replace_scene(ObstacleScene([POST, BESIDE]))
    before = np.array([[[0.0, -0.12, 0.3], [0.0, -0.4, 0.3]]])
    behind = np.array([[[0.0, 0.12, 0.3], [0.0, -0.4, 0.3]]])
    length = shortest_path_length(*behind[0], [POST])
    assert 0.56 < length < 0.62
    # It is remembered: the obstacle's bounding sphere is in the way, the obstacle is not.
    assert slack(constraint, before)[0] == pytest.approx(0.27)
    for positions in (behind, np.concatenate([before, behind])):
        assert slack(constraint, positions)[-1] == pytest.approx(0.55 - length, abs=1e-3)


def test_path_searched_from_an_end_inside_an_obstacle_bounds_nothing_outside() -> None:
    constraint = RopeLengthConstraint(0.65)
    constraint.replace_scene(ObstacleScene([POST]))
    inside = np.array([[[-0.09, 0.0, 0.3], [0.3, 0.0, 0.3]]])
    # Through the obstacle, which is ignored: an end inside breaks another rule.
    assert slack(constraint, inside)[0] == pytest.approx(0.26)
    outside = grips(0.33)
    length = shortest_path_length(*outside[0], [POST])
    assert length > 0.65
    assert slack(constraint, outside)[0] == pytest.approx(0.65 - length, abs=1e-3)


def test_rope_that_is_drawn_tight_round_a_post_is_refused_when_it_is() -> None:
    constraint = RopeLengthConstraint(0.62)
    constraint.replace_scene(ObstacleScene([TABLE, POST]))
    slack(constraint, grips(0.25))
    refused = None
    for half in np.arange(0.25, 0.32, 0.0005):
        found = hurried_slack(constraint, grips(half, half + 0.0005))
        if first_broken({"overstretch": found}) is not None:
            refused = half + 0.0005
            break
    assert refused is not None
    assert round_the_post(refused) == pytest.approx(0.62, abs=2.5e-3)
    # The cell stands there; what was searched meanwhile permits no more than the rope's length.
    for _ in range(20):
        found = hurried_slack(constraint, grips(refused - 0.0005, refused + 0.003))
        assert first_broken({"overstretch": found}) is not None


BEAMS = tuple(
    Obstacle("box", (0.0, 0.0, z), size=(2.0, 0.02, 0.2), name=f"beam at {z:g}")
    for z in (0.088, 0.288, 0.512, 0.712)
)
"""Beams of 20 mm, one above the other, with one gap of 24 mm."""


def through_the_gap(ends: np.ndarray) -> float:
    """Length of the shortest path through the gap of `BEAMS`, bent at the two edges nearest."""

    def length(places: np.ndarray) -> float:
        first, second = (
            np.array([x, y, z]) for x, y, z in zip(places, (-0.01, 0.01), edges, strict=True)
        )
        return float(
            np.linalg.norm(ends[0] - first)
            + np.linalg.norm(second - first)
            + np.linalg.norm(ends[1] - second)
        )

    # The left end is above the gap, and the right one below.
    edges = 0.412, 0.388
    return float(minimize(length, np.zeros(2)).fun)


def test_rope_that_leads_through_a_gap_is_followed_where_it_bends_round_both_edges() -> None:
    constraint = RopeLengthConstraint(0.418)
    constraint.replace_scene(ObstacleScene([TABLE, *BEAMS]))
    straight = np.array([[0.0, -0.2, 0.4], [0.0, 0.2, 0.4]])
    bent = np.array([[-0.1, -0.15, 0.52], [0.06, 0.14, 0.28]])
    way = [straight + share * (bent - straight) for share in np.linspace(0.0, 1.0, 200)]
    for k in range(len(way) - 20):
        # A chunk, and what is left of it at the next evaluation, a twentieth further on.
        found = hurried_slack(constraint, np.array(way[k : k + 20]))
        assert first_broken({"overstretch": found}, 0.0015) is None, k
    # At rest, what is sought ahead is found.
    for _ in range(40):
        hurried_slack(constraint, np.array(way[-21:-1]))
    found = hurried_slack(constraint, np.array(way[-21:-1]))
    assert found[-1] == pytest.approx(0.418 - through_the_gap(way[-2]), abs=2e-3)
