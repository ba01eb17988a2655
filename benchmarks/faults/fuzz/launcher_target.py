"""Launcher under hostile messages, without a bus: it runs until a batch is taken."""

from __future__ import annotations

import io
import sys
import tempfile
import traceback
from collections.abc import Sequence
from pathlib import Path

from benchmarks.faults.fuzz.hostile_messages import HostileMessages
from benchmarks.faults.fuzz.message_targets import PLACEHOLDERS, Totals, corpus_of
from lariat.scenario import find
from shared.bus.message_check import MessageCheck
from shared.runtime.service import Received
from shared.topics import Topic
from stack.launcher.console import ProcessConsole
from stack.launcher.launcher import Launcher
from stack.launcher.process import Program
from stack.scenario_manager.campaign.campaigns import Campaigns
from stack.scenario_manager.library import ScenarioLibrary
from stack.scenario_manager.scenario_manager import ScenarioManager
from stack.simulation.simulated_time import START, Delivery

CHECK = (sys.executable, "-S", "-c", "")
"""Command that finds every scenario in order."""
PROGRAM = Program("sleeper", "benchmarks.faults.fuzz.sleeper", ready_line="ready")
"""Process that the launcher runs."""


class BatchTakenError(Exception):
    """All messages of a batch have been taken."""


class LauncherTarget:
    """Launcher that takes hostile messages while it runs one process."""

    def __init__(self, lawful: Sequence[Delivery]) -> None:
        """Create a target."""
        self._corpus = corpus_of(lawful)

    def run_batch(self, seed: str, count: int, totals: Totals) -> None:
        """Run a launcher that takes hostile messages, and ends."""
        bus = HostileBus(HostileMessages(seed, self._corpus), count, totals)
        with tempfile.TemporaryDirectory() as folder:
            first = find("three-cylinders")
            library = ScenarioLibrary(Path(folder, "saved"), first)
            trials = Campaigns(Path(folder, "tables"), Path(folder, "trials"), lambda *_: CHECK[1:])
            switch = ScenarioManager(
                library, first, Path(folder, "started"), lambda _: CHECK, trials
            )
            console = ProcessConsole(io.StringIO())
            launcher = Launcher((PROGRAM,), bus, console, switch, lambda _: (PROGRAM,))  # pyright: ignore[reportArgumentType]
            try:
                # It is stopped in the middle of its watch, as by a signal.
                launcher.run(lambda _: None)
            except BatchTakenError:
                pass
            except Exception:
                totals.failures.append(f"launcher {seed}: {traceback.format_exc(limit=-4)}")
        totals.messages += bus.left
        totals.steps += 1

    def close(self) -> None:
        """Do nothing."""


class HostileBus:
    """Bus whose subscriptions yield hostile messages only."""

    def __init__(self, source: HostileMessages, count: int, totals: Totals) -> None:
        """Create a bus with a number of messages."""
        self._source, self.left, self._totals = source, count, totals
        self._check = MessageCheck()
        self.ended = False
        """Whether the messages have run out once."""

    def subscribe(self, topic: Topic, own: bool = True) -> HostileSubscription:
        """Return a subscription to a topic."""
        del own
        return HostileSubscription(self, topic)

    def publisher(self, topic: Topic) -> HostileBus:
        """Return a publisher that sends nothing."""
        del topic
        return self

    def put(self, message: object) -> None:
        """Send nothing."""

    def draw(self, topic: Topic) -> tuple[str, Received] | None:
        """Return the next message as far as the check of the bus accepts it.

        Raises:
            BatchTakenError: Once, when there is none left.
        """
        if not self.left:
            if self.ended:
                return None
            self.ended = True
            raise BatchTakenError
        self.left -= 1
        self._totals.messages += 1
        if "{" in topic.key:
            topic = topic.at(PLACEHOLDERS[self.left % len(PLACEHOLDERS)])
        raw = self._source.draw(topic, START)
        message = self._check.decode(topic, raw)
        if message is None:
            return None
        self._totals.accepted += 1
        return raw.key, Received(message, raw.publisher, raw.sequence, raw.received)


class HostileSubscription:
    """Subscription that yields some hostile messages at a time."""

    def __init__(self, bus: HostileBus, topic: Topic, count: int = 32) -> None:
        """Create a subscription."""
        self._bus, self._topic, self._count = bus, topic, count

    def take(self) -> list[tuple[str, Received]]:
        """Return the accepted ones of the next messages."""
        drawn = (self._bus.draw(self._topic) for _ in range(self._count))
        return [item for item in drawn if item is not None]
