"""Parts of the planner that are switched off."""

from __future__ import annotations

import pytest

from benchmarks.narrow.ablation import PARTS, PlanSpec, run_trial


def test_without_trees_no_way_through_a_narrow_gap_is_found_and_all_is_switched_on_again() -> None:
    off, on = (
        run_trial(PlanSpec(part, "posts", 2.0, 3, 700))
        for part in PARTS
        if part in ("nothing", "tree searches")
    )
    assert on["reached"] != off["reached"]


def test_each_part_is_one_that_is_there() -> None:
    for replacements in PARTS.values():
        for owner, name, _ in replacements:
            assert hasattr(owner, name)


def test_an_unknown_part_is_named() -> None:
    with pytest.raises(ValueError, match=r"'legs'.*tree searches"):
        run_trial(PlanSpec("legs", "posts", 2.0, 0, 0))
