"""Table of the services' health: state, step times, overruns, refused messages."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from dashboard import markup, palette
from dashboard.markup import escaped
from dashboard.palette import Color
from dashboard.subscriptions import STALE_AGE
from shared.messages import Health, RecordState, StackState


@dataclass(frozen=True)
class ServiceState:
    """State of a service in one word."""

    word: str
    """State."""
    color: Color
    """Colour of the word."""


def service_state(health: Health | None, age: float, process: str = "") -> ServiceState:
    """Judge the state of a service by its newest health message and the launcher's word for it."""
    if process in ("dead", "stopped"):
        return ServiceState(process, palette.BAD)
    if process in ("starting", "restarting"):
        return ServiceState(process, palette.WARNING)
    if process == "frozen":
        return ServiceState("frozen", palette.BAD)
    if health is None:
        # Not every process is a service: the arm's emulator reports no health.
        return (
            ServiceState("ready", palette.GOOD)
            if process
            else ServiceState("not seen", palette.QUIET)
        )
    # A service reports at least once a second, or after a longer step.
    if age > STALE_AGE + 1e-3 * health.longest_step_ms:
        return ServiceState("silent" if not process else "frozen", palette.BAD)
    if health.step_p99_ms > max(health.period_ms, health.longest_step_ms) > 0.0:
        return ServiceState("slow", palette.WARNING)
    return ServiceState("ok", palette.GOOD)


def table_html(
    names: Iterable[str],
    health: Mapping[str, tuple[Health, float]],
    stack: StackState | None,
) -> str:
    """HTML table of all services; `health` has message and age by service."""
    processes = {p.service: p for p in stack.processes} if stack is not None else {}
    services = list(names)
    order = services + [n for n in processes if n not in services]
    rows = []
    for name in order:
        message, age = health.get(name, (None, 0.0))
        process = processes.get(name)
        state = service_state(message, age, process.state if process is not None else "")
        restarts = f" ×{process.restarts:d}" if process is not None and process.restarts else ""
        numbers = (
            (
                f"{message.step_p50_ms:.1f} / {message.step_p99_ms:.1f}",
                f"{message.period_ms:.0f}",
                f"{message.overruns}",
                f"{message.refused}",
                f"{age:.1f}",
            )
            if message is not None
            else ("–",) * 5
        )
        cells = "".join(f"<td style='text-align:right'>{escaped(n)}</td>" for n in numbers)
        rows.append(
            f"<tr><td>{escaped(name.replace('_', ' '))}</td>"
            f"<td style='color:{palette.text_css(state.color)};white-space:nowrap'>"
            f"● {escaped(state.word)}{restarts}</td>{cells}</tr>"
        )
        if message is not None and message.note:
            rows.append(
                f"<tr><td colspan='7' style='opacity:.65;padding-bottom:.4em'>"
                f"{escaped(message.note)}</td></tr>"
            )
    heads = ("", "state", "step p50 / p99 [ms]", "period [ms]", "overruns", "refused", "age [s]")
    return markup.table_html(heads, "".join(rows))


def recorder_html(record: RecordState | None) -> str:
    """HTML line about the file that the recorder writes."""
    if record is None:
        text = "No message from the recorder yet."
    elif record.recording:
        text = f"Recording {record.file}: {record.bytes / 1e6:.1f} MB, {record.messages} messages"
        text += f", {record.drops} lost" if record.drops else ""
    else:
        text = f"Not recording{f'; last file {record.file}' if record.file else ''}"
    if record is not None and record.free_space:
        size, free = record.recordings_size / 1e9, record.free_space / 1e9
        text += f"; {size:.3g} GB of recordings, {free:.3g} GB free"
    return (
        f"<div style='margin:.4em 1em;font-size:.8em;opacity:.8;word-break:break-all'>"
        f"{escaped(text)}</div>"
    )
