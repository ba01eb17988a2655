"""`lariat commission FILE`: the first day of a cell, one checked step after the other."""

from __future__ import annotations

import contextlib
import sys
from datetime import datetime
from pathlib import Path

import tyro

from cli.held_key import held_key
from cli.task import LOCAL, CellOptions
from lariat.scenario import Scenario, find, load
from shared import topics
from shared.messages import ArmStates
from stack.approach import approach
from stack.client import Client, RequestFailed, connect
from stack.commissioning.checklist import go_through
from stack.commissioning.live_link import LiveLink
from stack.commissioning.page_operator import PageOperator
from stack.commissioning.record import CommissioningRecord, record_path
from stack.commissioning.session import CellLink, Session

NO_PAGE = (
    "no page shows this checklist: the stack runs without its dashboard; start it again without "
    "--no-dashboard, or leave --page out"
)
"""Reason why a checklist on the page does not begin."""


def main(
    scenario: tyro.conf.Positional[Path],
    /,
    results: Path | None = None,
    page: bool = False,
    cell: CellOptions = LOCAL,
) -> int:
    """Go through the first day of a cell, step by step, while its stack runs.

    Start the stack with the same file in another terminal (lariat up FILE). Every step is checked
    and its result kept beside the file; those that have passed are left out the next time, as long
    as the settings on which they rest stay. Nothing moves that you have not just agreed to.

    Examples:
      lariat commission my-cell.toml
      lariat commission my-cell.toml --page

    Args:
        scenario: The cell's TOML file.
        results: File of the results; by default FILE with the ending .commissioning.json.
        page: Ask on the page, in its tab First day, instead of at this terminal.
        cell: Address of the stack.

    Returns:
        0 when no step failed, 1 at the first one that did.
    """
    if not page and not sys.stdin.isatty():
        raise RequestFailed(
            "commissioning needs a terminal, at which a person answers, or the page: give --page"
        )
    path = find(scenario)
    loaded = load(path)
    record = CommissioningRecord(results or record_path(path))
    with connect(cell) as client:
        passed = False
        try:
            passed = _on_page(client, loaded, record) if page else _here(client, loaded, record)
        except KeyboardInterrupt:
            print("stopped", flush=True)
        if not passed:
            _tell_power(client)
    print(f"results: {record.path}")
    return 0 if passed else 1


def _tell_power(client: Client) -> None:
    """Name the arms that keep their power after a checklist that did not come to its end."""
    with contextlib.suppress(RequestFailed):
        powered = [arm.arm for arm in client.newest_arm_state().arms if arm.powered]
        if powered:
            print(f"still powered: {', '.join(powered)}; `lariat disarm` takes the power")


def _here(client: Client, scenario: Scenario, record: CommissioningRecord) -> bool:
    session = Session(scenario, LiveLink(client, scenario), TerminalOperator())
    return go_through(session, record, datetime.now)


def _on_page(client: Client, scenario: Scenario, record: CommissioningRecord) -> bool:
    health = client.bus.subscribe(topics.HEALTH.at("dashboard"))
    client.wait(health, lambda _: True, NO_PAGE)
    operator = PageOperator(client, scenario, record, lambda text: print(text, flush=True))
    link = LiveLink(client, scenario, operator.publish_if_due)
    try:
        return go_through(Session(scenario, link, operator), record, datetime.now)
    finally:
        operator.close()


class TerminalOperator:
    """Person at the terminal."""

    approach_button = "the space bar"

    def begin(self, number: int) -> None:
        pass

    def tell(self, text: str) -> None:
        print(text, flush=True)

    def agree(self, question: str) -> bool:
        try:
            return input(f"  {question} [yes/no] ").strip().lower() in ("y", "yes")
        except EOFError:
            return False

    def approach(self, link: CellLink, shown: ArmStates) -> str:
        assert isinstance(link, LiveLink)
        with held_key() as held:
            distance = shown.approach_distance
            while True:
                print("  hold the space bar down; the arms stop when it is released", flush=True)
                held.wait()
                ended = approach(link.client, link.client.newest_arm_state(), distance, held)
                state = link.client.newest_arm_state()
                # Let go on their way, the arms wait for another approach.
                if not ended or not state.needs_approach:
                    return ended
                distance = state.approach_distance
