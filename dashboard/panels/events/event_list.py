"""What happened in the cell, newest last: from logs, and from changes of the states."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from enum import IntEnum

from foxglove_schemas_protobuf.Log_pb2 import Log

from dashboard import palette
from dashboard.markup import escaped
from dashboard.panels.events.advice import advice
from lariat.trajectory import SECOND
from shared.messages import FAILED, IDLE, PAUSED, REACHED, RUNNING, ArmStates, TaskState
from shared.messages import from_timestamp as nanoseconds

MAX_EVENTS = 500
"""Largest number of events that are kept [-]."""
MAX_SHOWN = 100
"""Largest number of events that are drawn [-]."""
MAX_TEXT = 400
"""Largest length of an event's text [characters]."""


class Level(IntEnum):
    """Weight of an event."""

    INFORMATION = 0
    WARNING = 1
    """A stop, a refusal, a run that failed, a warning in a log."""
    ERROR = 2


LEVELS = {"Everything": Level.INFORMATION, "Warnings": Level.WARNING, "Errors": Level.ERROR}
"""Least levels that a person may choose, by label."""
_COLORS = {
    Level.INFORMATION: palette.QUIET,
    Level.WARNING: palette.WARNING,
    Level.ERROR: palette.BAD,
}
_TASK_LEVELS = {FAILED: Level.WARNING}
_TASK_WORDS = {
    IDLE: "ended",
    RUNNING: "running",
    PAUSED: "paused",
    REACHED: "goal reached",
    FAILED: "failed",
}


@dataclass(frozen=True)
class Event:
    """Line of the list."""

    time: int
    """Time of the event [ns]."""
    level: Level
    """Weight."""
    source: str
    """Service that it comes from."""
    text: str
    """What happened."""
    advice: str = ""
    """What a person can do."""
    count: int = 1
    """Number of times that it happened in a row [-]."""


class EventList:
    """Events of the cell; one that repeats itself is counted."""

    def __init__(self) -> None:
        self._events: deque[Event] = deque(maxlen=MAX_EVENTS)
        self._arms: tuple[int, str, bool] | None = None
        self._arms_refusal = self._task_refusal = ("", "")
        self._task: tuple[int, str] | None = None
        self._stop = ""
        """Reason of the newest stop that is listed."""
        self.revision = 0
        """Number of changes."""

    def clear(self) -> None:
        """Drop all events, for a jump in a recording."""
        self.__init__()

    def take_log(self, log: Log) -> None:
        """Take a log record; the gateway's about a stop that its state tells is left out."""
        if self._stop and _logs_stop(log.name, log.message, self._stop):
            return
        error, warning = log.level >= Log.Level.ERROR, log.level >= Log.Level.WARNING
        level = Level.ERROR if error else Level.WARNING if warning else Level.INFORMATION
        self._add(Event(nanoseconds(log.timestamp), level, log.name, log.message))

    def take_arms(self, arms: ArmStates) -> None:
        """Take a state of the gateway: changes of what it holds for, and refused commands."""
        stopped = arms.mode in (ArmStates.HOLDING, ArmStates.FAULT, ArmStates.DISARMED)
        state = (arms.mode, arms.reason if stopped else "", arms.needs_acknowledgement)
        if state != self._arms and stopped and (arms.needs_acknowledgement or arms.needs_approach):
            todo = advice(arms.rule, arms.needs_acknowledgement, arms.needs_approach)
            level = Level.ERROR if arms.mode == ArmStates.FAULT else Level.WARNING
            rule = f" (rule {arms.rule})" if arms.rule else ""
            self._stop = arms.reason
            last = self._events[-1] if self._events else None
            if last is not None and _logs_stop(last.source, last.text, self._stop):
                self._events.pop()
            self._add(Event(arms.stamp, level, "robot_gateway", f"{arms.reason}{rule}", todo))
        if not stopped:
            self._stop = ""
        self._arms = state
        refusal = (arms.last_command, arms.refusal)
        if arms.refusal and refusal != self._arms_refusal:
            text = f"command refused: {arms.refusal}"
            self._add(Event(arms.stamp, Level.WARNING, "robot_gateway", text))
        self._arms_refusal = refusal

    def take_task(self, task: TaskState) -> None:
        """Take a state of the task: changes of the run, and refused requests."""
        state = (task.state, task.run)
        if self._task is not None and state != self._task and task.run:
            level = _TASK_LEVELS.get(task.state, Level.INFORMATION)
            words = _TASK_WORDS.get(task.state, "changed")
            reason = f": {task.reason}" if task.reason else ""
            self._add(Event(task.stamp, level, "controller", f"{task.run}: {words}{reason}"))
        self._task = state
        refusal = (task.last_request, task.refusal)
        if task.refusal and refusal != self._task_refusal:
            text = f"request refused: {task.refusal}"
            self._add(Event(task.stamp, Level.WARNING, "controller", text))
        self._task_refusal = refusal

    def selected(self, level: Level, words: str) -> list[Event]:
        """Return events from a level on that contain words, in any case; newest first."""
        pattern = words.casefold()
        return [
            event
            for event in reversed(self._events)
            if event.level >= level and pattern in f"{event.source} {event.text}".casefold()
        ]

    def _add(self, event: Event) -> None:
        event = replace(event, text=event.text[:MAX_TEXT])
        last = self._events[-1] if self._events else None
        if last is not None and (last.source, last.text) == (event.source, event.text):
            self._events[-1] = replace(event, count=last.count + 1)
        else:
            self._events.append(event)
        self.revision += 1


def _logs_stop(source: str, text: str, reason: str) -> bool:
    """Whether a log record is the gateway's about a stop for a reason."""
    return source == "robot_gateway" and text in (f"holding: {reason}", f"fault: {reason}")


def list_html(events: Iterable[Event]) -> str:
    """HTML of events, as they come."""
    rows = []
    for event in list(events)[:MAX_SHOWN]:
        at = datetime.fromtimestamp(event.time / SECOND, UTC).astimezone()
        times = f" ×{event.count:d}" if event.count > 1 else ""
        todo = f"<div style='opacity:.75'>→ {escaped(event.advice)}</div>" if event.advice else ""
        rows.append(
            f"<div style='margin:.35em 0'><span style='color:{palette.css(_COLORS[event.level])}'>●"
            f"</span> <span style='opacity:.6'>{at:%H:%M:%S} {escaped(event.source)}{times}"
            f"</span><br>{escaped(event.text)}{todo}</div>"
        )
    content = "".join(rows) or "<div style='opacity:.7'>Nothing of this kind yet.</div>"
    style = "margin:.4em 1em;font-size:.8em;line-height:1.3;max-height:480px;overflow:auto"
    return f"<div style='{style};word-break:break-word'>{content}</div>"
