from __future__ import annotations

import pytest

from benchmarks.narrow.ablation import PARTS, AblationSpec, run_trial
from lariat.planning import whole_path


def test_the_plant_judges_a_plan_and_a_part_that_is_switched_off_counts() -> None:
    search = whole_path._search_trees
    whole = run_trial(AblationSpec("nothing", "posts", 3.0, 0, 0))
    assert whole.planned
    assert whole.reached
    assert whole.clearance_mm > 0.0
    without = run_trial(AblationSpec("tree search", "posts", 3.0, 0, 0))
    assert not without.planned
    assert not without.reached
    assert whole_path._search_trees is search


def test_a_part_that_does_not_exist_is_refused_with_the_names_that_do() -> None:
    with pytest.raises(ValueError, match="optimizer"):
        run_trial(AblationSpec("optimiser", "posts", 3.0, 0, 0))


@pytest.mark.parametrize("part", PARTS)
def test_every_part_names_what_the_planner_has(part: str) -> None:
    for owner, name, replacement in PARTS[part]:
        assert getattr(owner, name) is not replacement
