"""Faults of a controller or state estimator from outside, which end the run."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from contextlib import contextmanager

from lariat.control.run.reasons import ReasonCode
from lariat.control.run.state_machine import RunEvent
from lariat.control.run.task import Task
from lariat.scenario.extensions import ExtensionFault

log = logging.getLogger(__name__)


class MethodFaults:
    """Faults of the classes from outside that a task's runs use."""

    def __init__(self, task: Task) -> None:
        """Begin without a fault.

        Args:
            task: Task whose run a fault ends.
        """
        self._task = task
        self.last = ""
        """Name of the class and what it did, until the next run; empty without a fault."""

    @contextmanager
    def blaming(self) -> Iterator[None]:
        """Give up the run, and name the cause, when a class from outside fails in the block."""
        try:
            yield
        except ExtensionFault as fault:
            if str(fault) != self.last:
                log.error("%s", fault)
            self.last = str(fault)
            if self._task.accepts(RunEvent.GIVE_UP):
                self._task.apply(RunEvent.GIVE_UP, ReasonCode.METHOD_FAULT, problem=self.last)
