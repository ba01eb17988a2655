"""The rod against closed-form solutions, by the problems of `lariat bench physics`."""

from __future__ import annotations

import pytest

from benchmarks.physics.problems import PROBLEMS


@pytest.mark.parametrize(
    ("name", "node_count"),
    [
        (name, count)
        for name, problem in PROBLEMS.items()
        for count, bound in zip(problem.node_counts, problem.bounds, strict=True)
        if bound < 1
    ],
)
def test_the_rod_meets_the_closed_form(name: str, node_count: int) -> None:
    problem = PROBLEMS[name]
    assert problem.error(node_count) <= problem.bounds[problem.node_counts.index(node_count)]


@pytest.mark.parametrize("name", ["heavy cantilever", "limp cantilever", "catenary"])
def test_error_falls_with_the_square_of_the_edge_length(name: str) -> None:
    coarse, fine = (PROBLEMS[name].error(count) for count in (21, 41))
    assert 3.5 < coarse / fine < 4.6
