"""Recorder of a run in simulated time."""

from __future__ import annotations

import logging
from collections import defaultdict
from pathlib import Path

from lariat.scenario import Scenario
from lariat.trajectory import SECOND
from services.recorder.view.cell_view import CellView
from shared import topics
from shared.messages import Message
from shared.recording import Writer
from shared.runtime.logs import log_message
from shared.topics import Topic
from stack.simulation.simulated_time import Delivery, SimulatedStack

DRAWING_PERIOD = SECOND // 30
"""Time between two drawings of the cell [ns]."""
_PUBLISHER = "recorder-0"


class RecorderTap:
    """Tap that records every message, the services' log, and drawings of the cell."""

    def __init__(self, path: Path, scenario: Scenario, stack: SimulatedStack) -> None:
        """Create the file.

        Args:
            path: The file, which must not exist.
            scenario: Scenario of the run.
            stack: Stack whose time is the start of the recording.

        Raises:
            OSError: It exists already or cannot be written.
        """
        self._writer = Writer(path, scenario, stack.now, {"time": "simulated"})
        self._stack = stack
        self._view = CellView(scenario)
        self._drawn = stack.now - DRAWING_PERIOD
        self._sequences: dict[tuple[str, str], int] = defaultdict(int)
        self._log = _LogTap(self)

    def __call__(self, delivery: Delivery) -> None:
        """Record one message."""
        self._writer.write(
            delivery.topic,
            delivery.payload,
            delivery.publisher,
            delivery.sequence,
            delivery.received,
            delivery.published,
        )
        self._view.take(delivery.key, delivery.payload)
        if delivery.received - self._drawn >= DRAWING_PERIOD:
            self._drawn = delivery.received
            for topic, message in self._view.draw(delivery.received):
                self._write(topic, message, _PUBLISHER, delivery.received)

    def log(self, service: str, record: logging.LogRecord) -> None:
        """Record a line of a service's log, at the present simulated time."""
        message = log_message(record, record.getMessage(), service, self._stack.now)
        self._write(topics.LOG.at(service), message, f"{service}-0", self._stack.now)

    def close(self) -> None:
        """Close the file."""
        self._log.close()
        self._writer.close()

    def _write(self, topic: Topic, message: Message, publisher: str, now: int) -> None:
        sequence = self._sequences[topic.key, publisher]
        self._sequences[topic.key, publisher] += 1
        payload = message.SerializeToString(deterministic=True)
        self._writer.write(topic, payload, publisher, sequence, now, now)


class _LogTap(logging.Handler):
    """Handler that records what the services log, and passes warnings on to standard error."""

    def __init__(self, recorder: RecorderTap) -> None:
        super().__init__(logging.INFO)
        self._recorder = recorder
        self._logger = logging.getLogger("services")
        self._level = self._logger.level
        self._logger.setLevel(logging.INFO)
        self._logger.addHandler(self)

    def emit(self, record: logging.LogRecord) -> None:
        """Record one line."""
        self._recorder.log(record.name.split(".")[1], record)
        last = logging.lastResort
        # As long as nothing else handles the log, Python prints warnings only without a handler.
        if last and record.levelno >= last.level and not logging.getLogger().handlers:
            last.handle(record)

    def close(self) -> None:
        """Leave the log as it was."""
        self._logger.removeHandler(self)
        self._logger.setLevel(self._level)
        super().close()
