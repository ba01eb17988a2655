"""Log records of a process: lines on standard error, and messages on `log/{service}`."""

from __future__ import annotations

import logging
import re
import time
from typing import TYPE_CHECKING

from foxglove_schemas_protobuf.Log_pb2 import Log

from lariat.plain_text import plain_text
from shared.messages import timestamp

if TYPE_CHECKING:
    from shared.bus import Publisher

_FOXGLOVE_LEVELS = {
    logging.DEBUG: Log.Level.DEBUG,
    logging.INFO: Log.Level.INFO,
    logging.WARNING: Log.Level.WARNING,
    logging.ERROR: Log.Level.ERROR,
    logging.CRITICAL: Log.Level.FATAL,
}

FOLDING_PERIOD = 60.0
"""Time after which a record that is repeated passes again [s]."""
MAX_REPETITIONS = 3
"""Most records of one text that pass in that time."""
MAX_FOLDED = 256
"""Most texts that are remembered."""


class PlainFormatter(logging.Formatter):
    """Formatter of text, as it stands in a record, without control characters."""

    def format(self, record: logging.LogRecord) -> str:
        """Return the record as text."""
        return plain_text(super().format(record))


class LineFormatter(PlainFormatter):
    """Formatter that puts the level before every record that is not information."""

    def format(self, record: logging.LogRecord) -> str:
        """Return the record as text."""
        text = super().format(record)
        return text if record.levelno == logging.INFO else f"{record.levelname.lower()}: {text}"


class RepetitionFilter(logging.Filter):
    """Filter that passes a record a few times a minute, and then says how often it came.

    Records are the same if their texts differ in numbers alone, or if their `fold`, an attribute
    that `extra` gives them, is the same.
    """

    def __init__(self) -> None:
        super().__init__()
        self._counts: dict[tuple[int, str], tuple[float, int]] = {}
        """Beginning of the present minute [s] and number of records in it."""

    def filter(self, record: logging.LogRecord) -> bool:
        """Return whether a record passes; add the number of those that did not."""
        text = record.getMessage()
        key = record.levelno, getattr(record, "fold", "") or re.sub(r"\d+", "#", text)
        begun, count = self._counts.pop(key, (record.created, 0))
        if record.created - begun >= FOLDING_PERIOD:
            if count > MAX_REPETITIONS:
                more = count - MAX_REPETITIONS
                record.msg, record.args = f"{text} ({more} more before)", None
            begun, count = record.created, 0
        self._counts[key] = begun, count + 1
        if len(self._counts) > MAX_FOLDED:
            del self._counts[next(iter(self._counts))]
        return count < MAX_REPETITIONS


class BusHandler(logging.Handler):
    """Handler that publishes log records on the bus."""

    def __init__(self, publisher: Publisher, service: str) -> None:
        super().__init__(logging.INFO)
        self.addFilter(RepetitionFilter())
        self._publisher = publisher
        self._service = service
        self.setFormatter(PlainFormatter())

    def emit(self, record: logging.LogRecord) -> None:
        """Publish one record."""
        text = self.format(record)
        self._publisher.put(log_message(record, text, self._service, time.time_ns()))


def log_message(record: logging.LogRecord, text: str, service: str, stamp: int) -> Log:
    """Return the message of a log record."""
    return Log(
        timestamp=timestamp(stamp),
        level=_FOXGLOVE_LEVELS.get(record.levelno, Log.Level.UNKNOWN),
        message=text,
        name=service,
        file=record.filename,
        line=record.lineno,
    )


def log_to_standard_error() -> None:
    """Send the log records of this process to standard error."""
    handler = logging.StreamHandler()
    handler.setFormatter(LineFormatter())
    handler.addFilter(RepetitionFilter())
    logging.basicConfig(level=logging.INFO, handlers=[handler], force=True)
