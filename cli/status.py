"""`lariat status`: state of a running stack."""

from __future__ import annotations

import json as jsons
import time
from typing import Any

from cli import arm, task
from cli.task import LOCAL, CellOptions, JsonOption
from lariat.plain_text import plain_text
from shared import topics
from shared.messages import ArmStates, Health, RunState
from stack.client import connect

LISTENING_TIME = 1.5
"""Duration of listening [s]; every state is published at least once a second."""
POLL_PERIOD = 0.02
"""Time between two reads of the subscriptions [s]."""


def main(json: JsonOption = False, cell: CellOptions = LOCAL) -> int:
    """Show the run, the arms and the health of every process.

    Examples:
      lariat status
      lariat status --json

    Returns:
        0 when every process is ready, 1 when one is not.
    """
    listed = (topics.TASK_STATE, topics.ARM_STATE, topics.HEALTH, topics.STACK_STATE)
    newest: dict[str, Any] = {}
    with connect(cell) as client:
        subscriptions = [client.bus.subscribe(topic) for topic in listed]
        deadline = time.monotonic() + LISTENING_TIME
        while time.monotonic() < deadline:
            for subscription in subscriptions:
                newest.update({key: item.message for key, item in subscription.take()})
            time.sleep(POLL_PERIOD)
        alive = client.bus.alive()
    states = {}
    if stack := newest.get(topics.STACK_STATE.key):
        states = {p.service: p.state for p in stack.processes}
    health = {k.partition("/")[2]: m for k, m in newest.items() if k.startswith("health/")}
    names = list(dict.fromkeys([*states, *sorted(alive | health.keys())]))
    rows = {n: _row(n, states.get(n, ""), health.get(n), n in alive) for n in names}
    run, arms = newest.get(topics.TASK_STATE.key), newest.get(topics.ARM_STATE.key)
    if json:
        answer = {
            "task": task.as_json(run) if run else None,
            "arms": arm.as_json(arms) if arms else None,
            "processes": rows,
        }
        print(jsons.dumps(answer))
    else:
        if run:
            name = RunState.Name(run.state).lower()
            print(f"run   {name}: {run.reason}; error {1e3 * run.error:.2f} mm")
        else:
            print("run   no controller answers")
        print(f"arms  {arm.summary_line(arms)}" if arms else "arms  no gateway answers")
        for line in arm.device_lines(arms or ArmStates()):
            print(f"      {line}")
        _print_table(rows)
    return 0 if rows and run and arms and all(r["ok"] for r in rows.values()) else 1


def _row(name: str, state: str, health: Health | None, alive: bool) -> dict[str, Any]:
    if not state:
        state = "ready" if health else "frozen" if alive else "gone"
    row: dict[str, Any] = {"state": state, "ok": state == "ready"}
    if health:
        row |= {
            "rate_hz": round(1e3 / health.period_ms, 1),
            "step_p50_ms": round(health.step_p50_ms, 3),
            "step_p99_ms": round(health.step_p99_ms, 3),
            "step_max_ms": round(health.step_max_ms, 3),
            "steps": health.steps,
            "overruns": health.overruns,
            "drops": health.drops,
            "refused": health.refused,
            "note": health.note,
        }
    return row


def _print_table(rows: dict[str, dict[str, Any]]) -> None:
    # Imported late: it takes half a second, which --json does not need.
    from rich.table import Table
    from rich.text import Text

    from cli.terminal import Terminal

    table = Table(box=None, pad_edge=False)
    columns = (
        "process",
        "state",
        "Hz",
        "p50 ms",
        "p99 ms",
        "max ms",
        "overruns",
        "drops",
        "refused",
    )
    for column in columns:
        table.add_column(column, justify="left" if column in ("process", "state") else "right")
    for name, row in rows.items():
        keys = (
            "rate_hz",
            "step_p50_ms",
            "step_p99_ms",
            "step_max_ms",
            "overruns",
            "drops",
            "refused",
        )
        color = "green" if row["ok"] else "red"
        table.add_row(
            name, Text(plain_text(row["state"]), color), *(str(row.get(k, "")) for k in keys)
        )
    Terminal().print(table)
    for name, row in rows.items():
        # Notes are sentences, too long for a column.
        if row.get("note"):
            print(plain_text(f"{name}: {row['note']}"))
