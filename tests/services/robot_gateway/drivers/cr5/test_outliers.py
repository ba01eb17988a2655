"""Rejection of packets with impossible values."""

from __future__ import annotations

import numpy as np

from services.robot_gateway.drivers.cr5.outliers import OutlierFilter
from shared.cr5 import packet

TICK = 8_000_000


def at(joint: float, x: float = 300.0) -> np.ndarray:
    record = packet.blank()
    record["q_actual"], record["tool_vector_actual"][:3] = joint, (x, 0.0, 400.0)
    return record


def test_nan_and_too_large_values_are_implausible() -> None:
    assert packet.is_plausible(at(10.0))
    for spoiled in (np.nan, np.inf, 1e30, -500.0):
        assert not packet.is_plausible(at(spoiled))
    force = at(10.0)
    force["tcp_force"][2] = np.nan
    assert not packet.is_plausible(force)


def test_single_jump_is_rejected_and_a_lasting_one_accepted() -> None:
    outliers = OutlierFilter()
    seen = [at(10.0), at(11.0), at(60.0), at(12.0), at(13.0), at(13.0, 900.0), at(13.0, 901.0)]
    believed = [outliers.accepts(p, k * TICK) for k, p in enumerate(seen)]
    assert believed == [True, True, False, False, True, False, True]


def test_arm_at_full_speed_is_accepted() -> None:
    outliers = OutlierFilter()
    assert all(
        outliers.accepts(at(180.0 * k * 0.008, 300.0 + 16.0 * k), k * TICK) for k in range(50)
    )
