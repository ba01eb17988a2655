"""Runs over a bad network, or with clocks that differ: `lariat bench faults network`."""

from __future__ import annotations

import random
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from benchmarks.campaign import Campaign, Workers
from benchmarks.faults.clock_offsets import CLOCK_OFFSETS, with_clock_offsets
from benchmarks.tables import report
from lariat.configuration import ConfigurationError
from lariat.scenario import load
from lariat.trajectory import SECOND, MotionLimits
from shared import topics
from shared.messages import ArmStates
from stack import services
from stack.simulation import closed_loop
from stack.simulation.score import Score
from stack.simulation.simulated_time import Delivery, Network, session_id

DEFAULT_SCENARIO = Path("three-cylinders")
"""Scenario of the runs."""
MILLISECOND = 1_000_000
"""Duration of a millisecond [ns]."""
CUT_START, CUT_END = 4 * SECOND, 5 * SECOND
"""Simulated time in which a cut network passes nothing [ns]; the arms move then."""
SPEED_TOLERANCE = 1.01
"""Speed of a gripper as a fraction of its limit above which a run has failed [-]."""

Condition = Callable[[random.Random, Delivery], tuple[int, ...]]
"""Function to the delays of a message's copies [ns]."""


def _lost(share: float) -> Condition:
    return lambda rng, _: () if rng.random() < share else (0,)


def _doubled(share: float) -> Condition:
    return lambda rng, _: (0, rng.randrange(30 * MILLISECOND)) if rng.random() < share else (0,)


def _delayed(milliseconds: int) -> Condition:
    return lambda rng, _: (milliseconds * MILLISECOND,)


def _reordered(milliseconds: int) -> Condition:
    return lambda rng, _: (rng.randrange(milliseconds * MILLISECOND),)


def _cut(rng: random.Random, delivery: Delivery) -> tuple[int, ...]:
    del rng
    return () if CUT_START <= delivery.received < CUT_END else (0,)


CONDITIONS: dict[str, Condition] = {
    "whole": lambda rng, _: (0,),
    "lost-1": _lost(0.01),
    "lost-10": _lost(0.1),
    "lost-50": _lost(0.5),
    "doubled": _doubled(0.3),
    "delayed-20": _delayed(20),
    "delayed-100": _delayed(100),
    "reordered-20": _reordered(20),
    "reordered-80": _reordered(80),
    "cut": _cut,
}
"""Conditions of the network by name; numbers are percent of the messages, or milliseconds."""
NAMES = (*CONDITIONS, *CLOCK_OFFSETS)
"""Names of all conditions."""


@dataclass(frozen=True)
class NetworkSpec:
    """One run."""

    condition: str
    """Name in `NAMES`."""
    scenario: str
    """Scenario's TOML file, or the short name of a shipped one."""
    seed: int
    """Seed of the network."""


@dataclass(frozen=True)
class NetworkTrial:
    """Outcome of one run."""

    spec: NetworkSpec
    """Specification."""
    reached: bool
    """Whether the goal was reached."""
    final_error_mm: float | None
    """Mean node distance between true rope and goal at the end."""
    min_clearance_mm: float | None
    """Least distance between the surfaces of rope and obstacles."""
    causes: tuple[str, ...]
    """Stop causes that the gateway reported during the run, in order, once each."""
    top_speed: float
    """Largest speed of a gripper [m/s]."""
    failure: str
    """Promise that was not kept; empty if all were."""


def run(
    conditions: tuple[str, ...] = NAMES,
    scenario: Path = DEFAULT_SCENARIO,
    seed: int = 0,
    results: Path | None = None,
    workers: Workers = 1,
    json: bool = False,
) -> int:
    """Run a scenario in simulated time while the network disturbs every message, or clocks differ.

    A run either reaches its goal or stops with a cause; it touches no obstacle, and no gripper
    exceeds its speed. No person resumes what has stopped.

    Args:
        conditions: Conditions of network and clocks.
        scenario: Scenario of the runs.
        seed: Seed of the network.
        results: File of the finished runs, which are not run again.
        workers: Number of processes, or address of a Dask scheduler.
        json: Print one JSON object instead of a table.

    Returns:
        0 when every promise was kept, 1 otherwise.
    """
    for name in conditions:
        if name not in NAMES:
            raise ConfigurationError(f"no condition {name!r}; expected one of {', '.join(NAMES)}")
    specs = [NetworkSpec(name, str(scenario), seed) for name in conditions]
    campaign = Campaign(
        run_condition, NetworkTrial, lambda t: f"{t.spec.condition}: {t.failure or 'ok'}"
    )
    trials = campaign.trials(specs, results, workers)
    report(trials, json=json)
    return 1 if any(trial.failure for trial in trials) else 0


def run_condition(spec: NetworkSpec) -> NetworkTrial:
    """Run a scenario over a disturbed network, or with clocks that differ."""
    rng = random.Random(f"{spec.seed}/{spec.condition}")
    condition = CONDITIONS.get(spec.condition, CONDITIONS["whole"])
    network: Network = lambda delivery: condition(rng, delivery)  # noqa: E731
    states: list[ArmStates] = []

    def watch(delivery: Delivery) -> None:
        if delivery.key == topics.ARM_STATE.key:
            states.append(delivery.parse())

    scenario = closed_loop.with_emulated_arms(load(spec.scenario))
    built = [services.build(n, scenario, session_id(n)) for n in services.NAMES]
    members = with_clock_offsets(built, CLOCK_OFFSETS.get(spec.condition, {}))
    score = closed_loop.run(scenario, taps=(watch,), members=members, network=network).score
    speed = max(
        (sum(v * v for v in arm.linear_velocity) ** 0.5 for s in states for arm in s.arms),
        default=0.0,
    )
    causes = tuple(dict.fromkeys(state.cause for state in states if state.cause))
    return NetworkTrial(
        spec=spec,
        reached=score.reached,
        final_error_mm=score.final_error_mm,
        min_clearance_mm=score.min_clearance_mm,
        causes=causes,
        top_speed=round(speed, 3),
        failure=_failure(score, causes, speed, scenario.limits),
    )


def _failure(score: Score, causes: tuple[str, ...], speed: float, limits: MotionLimits) -> str:
    """Promise that a run broke; empty if none."""
    if score.min_clearance_mm is not None and score.min_clearance_mm <= 0.0:
        return f"the rope is {-score.min_clearance_mm:.1f} mm inside of an obstacle"
    if speed > SPEED_TOLERANCE * limits.speed:
        return f"a gripper moves at {speed:.3f} m/s"
    if not score.reached and not causes:
        return "the goal was not reached, and no cause was given"
    return ""
