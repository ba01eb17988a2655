"""Logs of a process: readable lines on standard error, and `log/{service}` on the bus."""

from __future__ import annotations

import logging
import time
from typing import TYPE_CHECKING

from foxglove_schemas_protobuf.Log_pb2 import Log

from shared.messages import timestamp

if TYPE_CHECKING:
    from shared.bus import Publisher

_LEVELS = {
    logging.DEBUG: Log.Level.DEBUG,
    logging.INFO: Log.Level.INFO,
    logging.WARNING: Log.Level.WARNING,
    logging.ERROR: Log.Level.ERROR,
    logging.CRITICAL: Log.Level.FATAL,
}


class LineFormatter(logging.Formatter):
    """A line as a person reads it: information bare, the rest with its level in front."""

    def format(self, record: logging.LogRecord) -> str:
        text = super().format(record)
        return text if record.levelno == logging.INFO else f"{record.levelname.lower()}: {text}"


class BusHandler(logging.Handler):
    """Publishes log records."""

    def __init__(self, publisher: Publisher, service: str) -> None:
        super().__init__(logging.INFO)
        self._publisher = publisher
        self._service = service
        self.setFormatter(logging.Formatter())

    def emit(self, record: logging.LogRecord) -> None:
        self._publisher.put(
            Log(
                timestamp=timestamp(time.time_ns()),
                level=_LEVELS.get(record.levelno, Log.Level.UNKNOWN),
                message=self.format(record),
                name=self._service,
                file=record.filename,
                line=record.lineno,
            )
        )


def to_standard_error() -> None:
    """Sends the log records of this process to standard error."""
    handler = logging.StreamHandler()
    handler.setFormatter(LineFormatter())
    logging.basicConfig(level=logging.INFO, handlers=[handler], force=True)
