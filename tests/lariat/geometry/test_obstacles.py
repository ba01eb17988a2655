from dataclasses import replace

import numpy as np
import pytest

from lariat.geometry.obstacles import (
    TABLE,
    Obstacle,
    bounding_box,
    chain_clearance,
    out_of_reach,
    pack,
    pack_supports,
    segment_distance,
    signed_distance,
)

BODIES = [
    Obstacle("box", (0.01, 0.0, 0.0), (0.8, 0.6, 0.0, 0.0), size=(0.1, 0.05, 0.07)),
    Obstacle("cylinder", (0.0, 0.02, 0.0), (0.8, 0.0, 0.6, 0.0), radius=0.03, height=0.1),
    Obstacle("sphere", (0.0, 0.0, 0.0), radius=0.05),
    Obstacle("capsule", (0.0, 0.0, 0.01), radius=0.03, height=0.1),
    TABLE,
]


def test_distances_are_those_of_the_shapes():
    upright = Obstacle("cylinder", (0.0, 0.0, 0.08), radius=0.03, height=0.16)
    points = np.array([[0.05, 0.0, 0.08], [0.0, 0.0, 0.2], [0.0, 0.0, 0.08], [0.06, 0.0, 0.20]])
    assert signed_distance(points, upright) == pytest.approx([0.02, 0.04, -0.03, 0.05])


@pytest.mark.parametrize("body", BODIES, ids=lambda b: b.shape)
def test_no_point_is_near_a_body_that_is_out_of_reach(body: Obstacle):
    rng = np.random.default_rng(0)
    ruled_out = 0
    for _ in range(200):
        points = rng.normal(size=(2, 3, 3)) * 0.03 + rng.normal(size=3) * 0.2
        reach = rng.uniform(0.0, 0.1)
        if out_of_reach(bounding_box(points), body, reach):
            ruled_out += 1
            assert np.min(signed_distance(points, body)) > reach
    assert ruled_out > 20


def test_the_outside_of_a_region_to_keep_in_is_never_out_of_reach():
    points = np.array([[9.0, 9.0, 9.0], [9.5, 9.0, 9.0]])
    for body in BODIES:
        assert not out_of_reach(bounding_box(points), replace(body, keep_in=True), 0.01)


@pytest.mark.parametrize("body", BODIES, ids=lambda b: b.shape)
def test_a_segment_is_as_near_as_its_nearest_point(body: Obstacle):
    rng = np.random.default_rng(0)
    starts = rng.normal(size=(50, 3)) * 0.1
    ends = starts + rng.normal(size=(50, 3)) * 0.05
    fractions = np.linspace(0.0, 1.0, 5001)[:, None, None]
    dense = np.min(signed_distance(starts + fractions * (ends - starts), body), axis=0)
    assert segment_distance(starts, ends, body) == pytest.approx(dense, abs=2e-5)


@pytest.mark.parametrize("body", BODIES[:-1], ids=lambda b: b.shape)
def test_a_chain_is_as_near_as_its_nearest_segment(body: Obstacle):
    """Nodes are far from the body, and an edge between them passes it."""
    nodes = np.array([[-0.5, 0.3, 0.1], [-0.3, -0.02, 0.12], [0.3, 0.01, 0.11], [0.4, 0.3, 0.1]])
    expected = np.min(segment_distance(nodes[:-1], nodes[1:], body))
    assert np.min(signed_distance(nodes, body)) > expected + 0.1
    assert chain_clearance(nodes, 0.004, [body]) == pytest.approx(expected - 0.004, abs=1e-9)
    assert chain_clearance(nodes, 0.004, BODIES) <= expected - 0.004
    assert chain_clearance(nodes, 0.004, []) == np.inf


@pytest.mark.parametrize("shape", ["box", "cylinder", "sphere", "capsule"])
def test_distance_from_a_region_is_that_of_its_body_with_the_sign_turned(shape: str) -> None:
    random = np.random.default_rng(5)
    body = Obstacle(shape, (0.1, 0.0, 0.2), radius=0.2, height=0.3, size=(0.5, 0.4, 0.3))
    region = replace(body, keep_in=True)
    starts, ends = np.array(body.position) + 0.2 * random.normal(size=(2, 500, 3))
    np.testing.assert_array_equal(signed_distance(starts, region), -signed_distance(starts, body))
    along = starts + np.linspace(0.0, 1.0, 401)[:, None, None] * (ends - starts)
    sampled = np.min(signed_distance(along, region), axis=0)
    np.testing.assert_allclose(segment_distance(starts, ends, region), sampled, atol=1e-12)


def test_a_region_is_no_body_for_the_kernels() -> None:
    with pytest.raises(ValueError, match="'box' is a region"):
        pack([Obstacle("box", (0.0, 0.0, 0.0), size=(1.0, 1.0, 1.0), keep_in=True, name="box")])


def test_only_the_supports_are_packed_for_the_rod() -> None:
    bar = replace(BODIES[1], support=True)
    supports = pack_supports([*BODIES, bar])
    assert supports is not None
    np.testing.assert_array_equal(supports, pack([bar]))
    assert pack_supports(BODIES) is None
