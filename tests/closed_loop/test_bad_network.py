"""Runs over a bad network, or with clocks that differ: each reaches its goal, or says why not."""

from __future__ import annotations

import random

import pytest

from lariat.scenario import load
from shared import topics
from shared.messages import ArmStates
from stack import services
from stack.simulation import closed_loop
from stack.simulation.simulated_time import Delivery, session_id
from tests.closed_loop.bad_network import CLOCK_OFFSETS, CONDITIONS, with_clock_offsets

pytestmark = pytest.mark.slow


@pytest.mark.parametrize("name", [*CONDITIONS, *CLOCK_OFFSETS])
def test_run_reaches_its_goal_or_stops_with_a_cause_and_touches_nothing(name: str) -> None:
    scenario = closed_loop.with_emulated_arms(load("three-cylinders"))
    rng, states = random.Random(f"0/{name}"), list[ArmStates]()
    condition = CONDITIONS.get(name, lambda rng, _: (0,))

    def watch(delivery: Delivery) -> None:
        if delivery.key == topics.ARM_STATE.key:
            states.append(delivery.parse())

    members = with_clock_offsets(
        [services.build(n, scenario, session_id(n)) for n in services.NAMES],
        CLOCK_OFFSETS.get(name, {}),
    )
    score = closed_loop.run(
        scenario, taps=(watch,), members=members, network=lambda d: condition(rng, d)
    ).score
    causes = {state.cause for state in states} - {""}
    assert score.reached or causes
    assert score.min_clearance_mm is None or score.min_clearance_mm > 0.0
    speeds = [sum(v * v for v in arm.linear_velocity) ** 0.5 for s in states for arm in s.arms]
    assert 0.01 < max(speeds) < 1.01 * scenario.limits.speed
