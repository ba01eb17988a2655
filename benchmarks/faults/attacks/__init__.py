"""Attacks on a live stack by those who may not use it: `lariat bench faults attacks`."""

from __future__ import annotations

import json as encoder
import logging
import sys
from dataclasses import asdict
from pathlib import Path

from benchmarks.faults.attacks import bus_member, network_stranger, other_user, web_page
from benchmarks.faults.attacks.attack import Attack
from benchmarks.live_stack import LiveStack
from lariat.scenario.shipped import find

DEFAULT_SCENARIO = Path("three-cylinders")
"""Scenario of the stack: a cell that arms itself, so that whoever gets in could move it."""


def run(scenario: Path = DEFAULT_SCENARIO, json: bool = False) -> int:
    """Attack a live stack as a web page, another user, a machine of the network, a process.

    Another user and another machine are played by root alone; without it these attacks are left
    out, and the table says so.

    Args:
        scenario: A scenario's TOML file, or the short name of a shipped one.
        json: Print one JSON object instead of a table.

    Returns:
        0 when every attack was refused and nothing moved, 1 otherwise.
    """
    attacks: list[Attack] = []
    # What this process is refused is the result, not news.
    logging.disable(logging.WARNING)
    with LiveStack(find(scenario)) as stack:
        # First those that fork: the bus has not been joined yet.
        attacks += other_user.attacks(stack)
        attacks += network_stranger.attacks(stack)
        attacks += web_page.attacks(stack)
        attacks += bus_member.attacks(stack)
    logging.disable(logging.NOTSET)
    if json:
        print(encoder.dumps({"attacks": [asdict(each) for each in attacks]}))
    else:
        _print(attacks)
    return 0 if attacks and all(each.held for each in attacks) else 1


def _print(attacks: list[Attack]) -> None:
    from rich.console import Console
    from rich.table import Table

    table = Table(box=None, pad_edge=False)
    for head in ("who", "attempt", "outcome", ""):
        table.add_column(head)
    for each in attacks:
        table.add_row(each.who, each.attempt, each.outcome, "held" if each.held else "NOT HELD")
    Console(file=sys.stdout, width=160).print(table)
