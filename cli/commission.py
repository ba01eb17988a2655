"""`lariat commission FILE`: the first day of a cell, one checked step after the other."""

from __future__ import annotations

import sys
from datetime import datetime
from pathlib import Path

import tyro

from cli.held_key import held_key
from cli.task import LOCAL, CellOptions
from shared.messages import ArmStates
from shared.scenario import find, load
from stack.approach import approach
from stack.client import RequestFailed, connect
from stack.commissioning.checklist import go_through
from stack.commissioning.live_link import LiveLink
from stack.commissioning.record import CommissioningRecord, record_path
from stack.commissioning.session import CellLink, Session


def main(
    scenario: tyro.conf.Positional[Path],
    /,
    results: Path | None = None,
    cell: CellOptions = LOCAL,
) -> int:
    """Go through the first day of a cell, step by step, while its stack runs.

    Start the stack with the same file in another terminal (lariat up FILE). Every step is checked
    and its result kept beside the file; those that have passed are left out the next time, as long
    as the settings on which they rest stay. Nothing moves that you have not just agreed to.

    Examples:
      lariat commission my-cell.toml

    Args:
        scenario: The cell's TOML file.
        results: File of the results; by default FILE with the ending .commissioning.json.
        cell: Address of the stack.

    Returns:
        0 when no step failed, 1 at the first one that did.
    """
    if not sys.stdin.isatty():
        raise RequestFailed("commissioning needs a terminal, at which a person answers")
    path = find(scenario)
    loaded = load(path)
    record = CommissioningRecord(results or record_path(path))
    with connect(cell) as client:
        session = Session(loaded, LiveLink(client, loaded), TerminalOperator())
        passed = go_through(session, record, datetime.now)
    print(f"results: {record.path}")
    return 0 if passed else 1


class TerminalOperator:
    """Person at the terminal."""

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
            print("  hold the space bar down; the arms stop when it is released", flush=True)
            held.wait()
            newest = link.client.newest_arm_state()
            return approach(link.client, newest, shown.approach_distance, held)
