"""Runs of the repository's scenarios, as `lariat run` does them."""

from __future__ import annotations

from pathlib import Path

from lariat.scenario.settings import load_with
from stack.simulation import closed_loop
from stack.simulation.closed_loop import RunOutcome
from stack.simulation.simulated_time import Delivery

SCENARIOS = Path(__file__).parents[2] / "scenarios"


def run(name: str, *settings: str, record: Path | None = None) -> RunOutcome:
    """One run of a scenario with some of its values replaced, to half a second behind its goal."""
    return closed_loop.run(load_with(SCENARIOS / f"{name}.toml", settings), record, stop_after=0.5)


def messages(name: str, *settings: str) -> list[Delivery]:
    """All that was said in a run."""
    log: list[Delivery] = []
    closed_loop.run(load_with(SCENARIOS / f"{name}.toml", settings), taps=(log.append,))
    return log


def first_difference(one: list[Delivery], other: list[Delivery]) -> str:
    """Where two logs part; empty when they are the same, byte for byte."""
    for a, b in zip(one, other, strict=False):
        if a != b:
            return f"{a.key} of {a.publisher} at {a.received} ns"
    return "" if len(one) == len(other) else f"{len(one)} and {len(other)} messages"
