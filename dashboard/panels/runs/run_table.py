"""Table of runs, and what is said of one of them."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from datetime import UTC, datetime

from dashboard import markup, palette
from dashboard.controls.status_text import format_millimeters
from dashboard.markup import escaped
from lariat.trajectory import SECOND
from shared.messages import RunSummary

MAX_ROWS = 100
"""Largest number of rows of the table [-]."""


def time_text(run: RunSummary) -> str:
    """Start of a run in the time zone of this machine."""
    at = datetime.fromtimestamp(run.started / SECOND, UTC).astimezone()
    return f"{at:%Y-%m-%d %H:%M:%S}"


def label(run: RunSummary) -> str:
    """Name of a run in a list; unique, because its start is part of it."""
    return f"{'★ ' if run.star else ''}{time_text(run)} {run.scenario} {run.run}"


def verdict(run: RunSummary) -> str:
    """Outcome of a run in a word or two."""
    if run.reached:
        return "reached"
    return "not reached" if run.over else "goes on"


def matching(runs: Iterable[RunSummary], words: str) -> list[RunSummary]:
    """Return runs whose scenario, verdict, reason, method, note or time has all the words."""
    search = words.lower().split()
    return [run for run in runs if all(word in _words(run) for word in search)]


def _words(run: RunSummary) -> str:
    star = "★" * run.star
    return f"{label(run)} {verdict(run)} {run.reason} {run.method} {run.note} {star}".lower()


def table_html(runs: Sequence[RunSummary], selected: Collection[str]) -> str:
    """HTML table of runs, newest first; those that are selected are highlighted."""
    if not runs:
        return "<div style='margin:.5em 1em;opacity:.8'>No run is kept that matches.</div>"
    heads = ("", "start", "scenario, note", "verdict", "error", "clearance", "time")
    rows = []
    for run in runs[:MAX_ROWS]:
        color = palette.GOOD if run.reached else palette.QUIET if not run.over else palette.WARNING
        number = "text-align:right;white-space:nowrap"
        cells = (
            ("", "★" if run.star else ""),
            ("", time_text(run)[5:]),
            ("overflow-wrap:anywhere", run.scenario, run.note),
            (f"color:{palette.text_css(color)}", verdict(run)),
            (number, format_millimeters(run.error)),
            (number, format_millimeters(run.min_clearance)),
            (number, f"{run.duration:.1f} s"),
        )
        shade = "background:rgba(92,170,255,.15)" if run.id in selected else ""
        row = "".join(_cell_html(*cell) for cell in cells)
        rows.append(f"<tr style='{shade}'>{row}</tr>")
    return markup.table_html(heads, "".join(rows), "260px")


def _cell_html(style: str, text: str, more: str = "") -> str:
    """HTML of a cell; what is more is in dimmer type below."""
    below = f"<div style='opacity:.65'>{escaped(more)}</div>" if more else ""
    return f"<td style='{style}'>{escaped(text)}{below}</td>"


def detail_html(run: RunSummary | None) -> str:
    """HTML of everything that is known of a run."""
    if run is None:
        return ""
    replans = f"{run.replans} replan{'' if run.replans == 1 else 's'}"
    lines = [
        f"{verdict(run)}: {run.reason or 'no reason given'}; {replans}; "
        f"largest node error {format_millimeters(run.max_node_error)}",
        f"{run.method}, Lariat {run.version}",
    ]
    size = f" ({run.bytes / 1e6:.1f} MB)" if run.bytes else " (deleted)"
    lines.append(f"Recording: {', '.join(run.files) or 'none'}{size if run.files else ''}")
    if run.files and run.bytes:
        lines.append(f"lariat show recordings/{run.files[0]}")
    text = "<br>".join(escaped(line) for line in lines)
    style = "margin:.3em 1em;font-size:.8em;opacity:.85;word-break:break-word"
    return f"<div style='{style}'>{text}</div>"


def csv_text(time: Sequence[float], error: Sequence[float], clearance: Sequence[float]) -> str:
    """Curves of a run as CSV, in SI units; a clearance that is none stays empty."""
    rows = ["time [s],error [m],clearance [m]"]
    for t, e, c in zip(time, error, clearance, strict=True):
        rows.append(f"{t:.4f},{e:.7f},{f'{c:.7f}' if c >= 0.0 else ''}")
    return "\n".join(rows) + "\n"
