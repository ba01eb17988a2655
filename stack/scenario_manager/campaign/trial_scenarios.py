"""Scenarios of the trials that a request for a campaign names."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from pathlib import Path

from lariat.configuration import ConfigurationError
from lariat.scenario import Scenario
from shared.messages import StackRequest
from stack.scenario_manager.requested_scenario import requested_scenario

MAX_TRIALS = 200
"""Largest number of trials of a campaign [-]."""
MAX_VARIATIONS = 3
"""Largest number of settings that a campaign varies together [-]."""
MAX_SEED = 2**31 - 1
"""Largest seed of a trial [-]."""


@dataclass(frozen=True)
class TrialScenarios:
    """Scenario of one combination of values, and the seeds with which it is run."""

    values: tuple[str, ...]
    """Values of the keys that vary, in TOML."""
    scenario: Scenario
    """Scenario with these values."""
    seeds: range
    """Seeds of its trials."""


def trial_scenarios(request: StackRequest, base: Path) -> Iterator[TrialScenarios]:
    """Yield the scenarios of a campaign, the last setting varying fastest."""
    variations = list(request.variations)
    keys = [variation.key for variation in variations]
    if len(variations) > MAX_VARIATIONS:
        raise ConfigurationError(
            f"{len(variations)} settings vary; a campaign varies up to {MAX_VARIATIONS}"
        )
    for key in keys:
        if key == "seed" or keys.count(key) > 1:
            raise ConfigurationError(
                f"{key} varies twice; name each setting once, and seeds by their first and number"
            )
    count = request.seed_count
    for variation in variations:
        count *= len(variation.values)
    if not 1 <= count <= MAX_TRIALS:
        raise ConfigurationError(f"the campaign has {count} trials; it takes 1 to {MAX_TRIALS}")
    if request.first_seed + request.seed_count > MAX_SEED:
        raise ConfigurationError(f"first_seed = {request.first_seed} is above {MAX_SEED}")
    seeds = range(request.first_seed, request.first_seed + request.seed_count)
    for values in product(*(tuple(variation.values) for variation in variations)):
        varied = [f"{key}={value}" for key, value in zip(keys, values, strict=True)]
        trial = StackRequest(settings=[*request.settings, *varied])
        yield TrialScenarios(values, requested_scenario(trial, base), seeds)
