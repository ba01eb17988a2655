"""Who is alive, how fast they step and what they lose."""

from __future__ import annotations

import html
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from dashboard import palette
from dashboard.palette import Color
from shared.messages import Health, RecordState, StackState

SILENT = 2.5
"""Health comes each second: older than this [s], on top of what a step may last, a process is
frozen or gone."""


@dataclass(frozen=True)
class Verdict:
    """How one service is."""

    word: str
    color: Color


def verdict(health: Health | None, age: float, process: str = "") -> Verdict:
    """Judges one service.

    Args:
        health: Its own last word, None before the first.
        age: How long ago that came [s].
        process: What the launcher says: starting, ready, frozen, restarting, dead, stopped; or "".
    """
    if process in ("dead", "stopped"):
        return Verdict(process, palette.BAD)
    if process in ("starting", "restarting"):
        return Verdict(process, palette.WARNING)
    if process == "frozen":
        return Verdict("frozen", palette.BAD)
    if health is None:
        # Not every process of the stack is a service: an emulator has no step to speak of.
        return Verdict("ready", palette.GOOD) if process else Verdict("no sign", palette.QUIET)
    if age > SILENT + 1e-3 * health.longest_step_ms:
        return Verdict("silent" if not process else "frozen", palette.BAD)
    if health.step_p99_ms > max(health.period_ms, health.longest_step_ms) > 0.0:
        return Verdict("slow", palette.WARNING)
    return Verdict("ok", palette.GOOD)


def table(
    names: Iterable[str],
    health: Mapping[str, tuple[Health, float]],
    stack: StackState | None,
) -> str:
    """A table of all services for the page.

    Args:
        names: Services in the order of their rows.
        health: Last word and its age [s], by service.
        stack: The launcher's view, where there is one.
    """
    processes = {p.service: p for p in stack.processes} if stack is not None else {}
    known = list(names)
    order = known + [n for n in processes if n not in known]
    rows = []
    for name in order:
        message, age = health.get(name, (None, 0.0))
        process = processes.get(name)
        how = verdict(message, age, process.state if process is not None else "")
        restarts = f" ×{process.restarts}" if process is not None and process.restarts else ""
        numbers = (
            (
                f"{message.step_p50_ms:.1f} / {message.step_p99_ms:.1f}",
                f"{message.period_ms:.0f}",
                f"{message.overruns}",
                f"{message.drops}",
                f"{age:.1f}",
            )
            if message is not None
            else ("–",) * 5
        )
        cells = "".join(f"<td style='text-align:right'>{n}</td>" for n in numbers)
        rows.append(
            f"<tr><td>{html.escape(name.replace('_', ' '))}</td>"
            f"<td style='color:{palette.css(how.color)};white-space:nowrap'>● {how.word}"
            f"{restarts}</td>{cells}</tr>"
        )
        if message is not None and message.note:
            rows.append(
                f"<tr><td colspan='7' style='opacity:.65;padding-bottom:.4em'>"
                f"{html.escape(message.note)}</td></tr>"
            )
    heads = ("", "state", "step p50 / p99 [ms]", "period [ms]", "late", "unread", "age [s]")
    head = "".join(
        f"<th style='font-weight:500;opacity:.6;text-align:left'>{h}</th>" for h in heads
    )
    return (
        "<div style='margin:.5em .6em;overflow-x:auto'><table style='font-size:.78em;"
        "border-spacing:.55em .3em;font-variant-numeric:tabular-nums;line-height:1.25'>"
        f"<tr>{head}</tr>{''.join(rows)}</table></div>"
    )


def recorder_html(record: RecordState | None) -> str:
    """What the recorder writes."""
    if record is None:
        text = "The recorder has not spoken yet."
    elif record.recording:
        text = f"Recording {record.file}: {record.bytes / 1e6:.1f} MB, {record.messages} messages"
        text += f", {record.drops} lost" if record.drops else ""
    else:
        text = f"Not recording{f'; last file {record.file}' if record.file else ''}"
    return (
        f"<div style='margin:.4em 1em;font-size:.8em;opacity:.8;word-break:break-all'>"
        f"{html.escape(text)}</div>"
    )
