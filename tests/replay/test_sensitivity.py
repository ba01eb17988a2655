"""Replay detects a relative change of one part in a thousand of any service's numbers."""

from __future__ import annotations

import pytest

from benchmarks.replay import PERTURBATIONS, Perturbation, detects
from stack import services


def test_a_number_of_every_service_but_the_dashboard_is_scaled():
    assert {p.service for p in PERTURBATIONS} == set(services.ALL) - {"dashboard"}


@pytest.mark.parametrize(
    "perturbation", PERTURBATIONS, ids=lambda p: f"{p.service}-{p.quantity.replace(' ', '-')}"
)
def test_a_change_by_a_thousandth_is_detected(perturbation: Perturbation):
    assert detects(perturbation, 1e-3)
