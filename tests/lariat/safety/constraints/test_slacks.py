from __future__ import annotations

import numpy as np

from lariat.safety.constraints.slacks import SLACK_TOLERANCE, first_broken


def row(*slack: float) -> np.ndarray:
    return np.array(slack)


def test_path_with_positive_slack_keeps_every_rule() -> None:
    assert first_broken({"workspace": row(0.1, 0.2, 0.01), "table": row(0.1, 0.0, 0.1)}) is None


def test_first_broken_rule_is_named_with_its_excess() -> None:
    slacks = {"workspace": row(0.1, 0.1), "keep_out": row(0.1, -0.02), "table": row(0.1, -0.5)}
    rule, excess = first_broken(slacks) or ("", 0.0)
    assert rule == "keep_out"
    assert np.isclose(excess, 0.02)


def test_slack_at_the_boundary_is_kept_within_rounding() -> None:
    assert first_broken({"table": row(0.1, -0.5 * SLACK_TOLERANCE)}) is None
    assert first_broken({"table": row(0.1, -2.0 * SLACK_TOLERANCE)}) is not None


def test_margin_demands_more_than_zero() -> None:
    assert first_broken({"table": row(0.1, 0.001)}, margin=0.0015) == ("table", 0.0005)
    assert first_broken({"table": row(0.1, 0.002)}, margin=0.0015) is None


def test_rule_that_is_broken_already_may_get_better_but_not_worse() -> None:
    assert first_broken({"table": row(-0.02, -0.015, -0.02)}) is None
    assert first_broken({"table": row(-0.02, -0.021)}) == ("table", 0.021)


def test_path_without_poses_keeps_every_rule() -> None:
    assert first_broken({"table": row(0.1)}) is None


def test_slack_that_is_not_a_number_breaks_its_rule() -> None:
    assert first_broken({"keep_out": row(0.1, np.nan)}) is not None
    assert first_broken({"keep_out": row(np.nan, np.nan)}) is not None
    assert first_broken({"keep_out": row(0.1, 0.1, np.nan, 0.1)}) is not None
