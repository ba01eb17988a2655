"""Hostile messages and files for every process: `lariat bench faults fuzz`."""

from __future__ import annotations

import logging
import traceback
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path

import psutil
from hypothesis import HealthCheck, Phase, given, seed, settings

from benchmarks.campaign import Campaign, Workers
from benchmarks.faults.fuzz import targets as kinds
from benchmarks.tables import report
from lariat.configuration import ConfigurationError

SERVICES = ("robot_gateway", "controller", "planner", "perception", "sim", "recorder", "dashboard")
"""Services that are fuzzed."""
FILES = ("scenario", "nodes", "recording", "png", "jpeg", "stl", "obj")
"""Kinds of files."""
TARGETS = (*SERVICES, "launcher", "bus", *FILES)
"""Names of all targets."""
DEFAULT_SCENARIO = "three-cylinders"
"""Scenario of the services."""


@dataclass(frozen=True)
class FuzzSpec:
    """Examples for one target."""

    target: str
    """One of `TARGETS`."""
    count: int
    """Number of examples: a file, or up to sixteen messages before a step."""
    seed: int
    """Seed of all choices."""
    scenario: str
    """Scenario's TOML file, or the short name of a shipped one."""


@dataclass(frozen=True)
class FuzzTrial:
    """What they led to."""

    spec: FuzzSpec
    """Specification."""
    given: int
    """Number of examples that were given, up to the first failure."""
    accepted: int
    """Number of messages or files that passed the check."""
    memory_mb: float
    """Memory of the process afterwards [MB]."""
    failure: str
    """Exception or broken rule, with the example that led to it; empty: none."""


def run(
    targets: tuple[str, ...] = TARGETS,
    count: int = 1000,
    seed: int = 0,
    scenario: str = DEFAULT_SCENARIO,
    results: Path | None = None,
    workers: Workers = 1,
    json: bool = False,
) -> int:
    """Send hostile messages to every process, and hostile files to every reader.

    Messages: random bytes, valid ones with other values or bytes, wrong lengths, NaN, extremes of
    numbers, unknown enum values, other types, made-up publishers and numbers. They pass the check
    of the bus, and what it lets through reaches the service among the messages of an ordinary run.
    A failure is an exception, a body that vanishes from the gateway's scene, an arm that moves, or
    a page that ends. `bus` and `dashboard` need free ports of 127.0.0.1.

    Examples:
      lariat bench faults fuzz --count 200
      lariat bench faults fuzz --count 100000 --results fuzz.jsonl --workers 2

    Args:
        targets: Processes, the doors of a real bus, and kinds of files.
        count: Number of examples for each target.
        seed: Seed of all choices.
        scenario: Scenario of the services.
        results: File of the finished targets, which are not fuzzed again.
        workers: Number of processes, or address of a Dask scheduler.
        json: Print one JSON object instead of a table.

    Returns:
        0 when nothing failed, 1 otherwise.
    """
    for name in targets:
        if name not in TARGETS:
            raise ConfigurationError(f"no target {name!r}; expected one of {', '.join(TARGETS)}")
    campaign = Campaign(
        attack, FuzzTrial, lambda t: f"{t.spec.target}: {t.given} given, {t.failure or 'ok'}"
    )
    specs = [FuzzSpec(name, count, seed, scenario) for name in targets]
    trials = campaign.trials(specs, results, workers)
    report(trials, json=json)
    return 1 if any(trial.failure for trial in trials) else 0


def attack(spec: FuzzSpec) -> FuzzTrial:
    """Give examples to a target until one fails."""
    numbers = {"given": 0, "accepted": 0}
    failure = ""
    # Refusals are what is asked for, not news.
    logging.disable(logging.ERROR)
    try:
        with target_of(spec) as (strategy, give):

            @seed(spec.seed)
            @settings(
                max_examples=spec.count,
                # A process keeps a state: an example that is made smaller meets another one.
                phases=[Phase.generate],
                database=None,
                deadline=None,
                suppress_health_check=list(HealthCheck),
            )
            @given(strategy)
            def attempt(example: object) -> None:
                numbers["given"] += 1
                numbers["accepted"] += give(example)

            attempt()
    except Exception:
        failure = traceback.format_exc(limit=-6)
    finally:
        logging.disable(logging.NOTSET)
    memory = round(psutil.Process().memory_info().rss / 2**20, 1)
    return FuzzTrial(spec, **numbers, memory_mb=memory, failure=failure)


def target_of(spec: FuzzSpec) -> AbstractContextManager[kinds.Target]:
    """Return the target of a specification."""
    if spec.target in SERVICES:
        return kinds.service(spec.target, spec.scenario)
    if spec.target in FILES:
        return kinds.file(spec.target, spec.scenario)
    return {"launcher": kinds.launcher, "bus": kinds.bus}[spec.target](spec.scenario)
