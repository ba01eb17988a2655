"""The rod against closed forms, by the cases of `lariat bench physics`."""

from __future__ import annotations

import pytest

from benchmarks.physics.cases import CASES


@pytest.mark.parametrize(
    ("name", "node_count"),
    [
        (name, count)
        for name, case in CASES.items()
        for count, bound in zip(case.node_counts, case.bounds, strict=True)
        if bound < 1
    ],
)
def test_the_rod_meets_the_closed_form(name: str, node_count: int) -> None:
    case = CASES[name]
    assert case.error(node_count) <= case.bounds[case.node_counts.index(node_count)]


@pytest.mark.parametrize("name", ["heavy cantilever", "limp cantilever", "catenary"])
def test_error_falls_with_the_square_of_the_edge_length(name: str) -> None:
    coarse, fine = (CASES[name].error(count) for count in (21, 41))
    assert 3.5 < coarse / fine < 4.6
