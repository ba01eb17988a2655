"""Load of the dashboard's process: `lariat bench speed page FILE`.

A recorded run is played to a dashboard again and again, at its own pace with the images thinned, as
in a live stack. The processor time of the process comes from the kernel, its step times from its
health. Programs that read all that a page is sent stand for browsers, so that no browser competes
for the processor; a slow one reads a message only now and then.
"""

from __future__ import annotations

import os
import secrets
import subprocess
import sys
import tempfile
import time
from contextlib import ExitStack
from pathlib import Path
from typing import Annotated

import numpy as np
import tyro

from benchmarks.live_stack import free_port
from benchmarks.speed.pages import OpenPages
from benchmarks.speed.samples import sample_of
from benchmarks.tables import Result, publish
from lariat.configuration import ConfigurationError
from lariat.trajectory import SECOND
from shared import bus as buses
from shared import topics
from shared.bus import Bus, BusOptions
from shared.messages import Health, Message
from shared.recording import Recording
from shared.topics import Topic
from stack.launcher import module_entry
from stack.launcher.library_environment import LIBRARY_ENVIRONMENT

WARM_UP = 5.0
"""Time before the measurement [s]."""
START_TIMEOUT = 60.0
"""Longest wait for the page [s]."""
PAUSE = 0.5
"""Pause between two rounds of the recording [s]."""


def run(
    file: Annotated[Path, tyro.conf.Positional],
    /,
    pages: int = 1,
    slow_pages: int = 0,
    seconds: float = 30.0,
    image_rate: float = 10.0,
    json: bool = False,
    output: Path | None = None,
) -> int:
    """Print the load of the dashboard's process while a recorded run is played to it.

    Examples:
      lariat run three-cylinders --record run.mcap
      lariat bench speed page run.mcap
      lariat bench speed page run.mcap --pages 0
      lariat bench speed page run.mcap --slow-pages 1 --seconds 600

    Args:
        file: Recording of a run.
        pages: Number of pages that are open.
        slow_pages: Number of further pages that read two messages in a second.
        seconds: Duration of the measurement [s].
        image_rate: Rate to which images are thinned [Hz].
        json: Print one JSON object instead of a table.
        output: Folder for the table as CSV.
    """
    try:
        recording = Recording.open(file)
        played = _Played(recording, image_rate)
    except ValueError as error:
        raise ConfigurationError(str(error)) from error
    with tempfile.TemporaryDirectory() as folder:
        recording.scenario(Path(folder))
        scenario = Path(folder) / next(n for n in recording.files if n.endswith(".toml"))
        load = _measure(played, scenario, Path(folder), pages, slow_pages, seconds)
    rates = ", ".join(f"{key} {rate:.0f} Hz" for key, rate in played.rates.items() if rate >= 5.0)
    publish([Result("page", [load], f"played: {rates}")], json, output)
    return 0


class _Played:
    """Messages of a recording in order of time, as a dashboard reads them."""

    def __init__(self, recording: Recording, image_rate: float) -> None:
        self.messages: list[tuple[int, Topic, Message]] = []
        """Time since the first message [ns], topic and message."""
        images: dict[str, int] = {}
        begin = 0
        for entry in recording.messages():
            begin = begin or entry.log_time
            topic = entry.topic
            if topics.TRACE.matches(entry.key) or topic.key.startswith("view/"):
                continue
            if topic.large:
                if entry.log_time - images.get(entry.key, 0) < 0.99 * SECOND / image_rate:
                    continue
                images[entry.key] = entry.log_time
            self.messages.append((entry.log_time - begin, topic, entry.parse()))
        if not self.messages:
            raise ValueError(f"{recording.path} holds no message")
        self.duration = self.messages[-1][0] / SECOND
        """Duration of the recording [s]."""

    @property
    def rates(self) -> dict[str, float]:
        """Mean rate of each topic by key [Hz]."""
        keys = [topic.key for _, topic, _ in self.messages]
        return {key: round(keys.count(key) / self.duration, 1) for key in sorted(set(keys))}

    def play(self, bus: Bus, until: float) -> None:
        """Publish everything again and again until a time [s, monotonic]."""
        publishers = {key: bus.publisher(topics.find(key)) for key in self.rates}
        while time.monotonic() < until:
            begun = time.monotonic()
            for at, topic, message in self.messages:
                due = begun + at / SECOND
                if due > until:
                    return
                if (wait := due - time.monotonic()) > 0.0:
                    time.sleep(wait)
                publishers[topic.key].put(message)
            time.sleep(PAUSE)


def _measure(
    played: _Played, scenario: Path, folder: Path, pages: int, slow_pages: int, seconds: float
) -> dict[str, object]:
    """Load of the dashboard's process: of one core, of its steps, and what each page is sent."""
    port, page_port = free_port(), free_port()
    hub, namespace = f"tcp/127.0.0.1:{port}", f"page-{secrets.token_hex(4)}"
    token = folder / "token"
    arguments = ["--scenario", str(scenario), "--namespace", namespace, "--connect", hub]
    arguments += ["--port", str(page_port), "--token-file", str(token)]
    with ExitStack() as stack:
        bus = stack.enter_context(
            buses.open(BusOptions(namespace, connect=(), listen=(hub,)), "lariat")
        )
        process = subprocess.Popen(
            [sys.executable, *module_entry.command("dashboard", *arguments)],
            env={**os.environ, **LIBRARY_ENVIRONMENT},
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        stack.callback(process.wait)
        stack.callback(process.terminate)
        healths = bus.subscribe(topics.HEALTH.at("dashboard"))
        deadline = time.monotonic() + START_TIMEOUT
        while not healths.take():
            if time.monotonic() > deadline or process.poll() is not None:
                raise RuntimeError("the dashboard does not start")
            time.sleep(0.05)
        address = f"http://127.0.0.1:{page_port}/?token={token.read_text().strip()}"
        readers = None
        if pages:
            readers = OpenPages(address, pages)
            stack.callback(readers.close)
        if slow_pages:
            stack.callback(OpenPages(address, slow_pages, pause=0.5).close)
        played.play(bus, time.monotonic() + WARM_UP)
        healths.take()
        received = readers.received if readers else 0
        first, begun = sample_of("dashboard", process.pid, 0.0), time.monotonic()
        played.play(bus, begun + seconds)
        elapsed = time.monotonic() - begun
        last = sample_of("dashboard", process.pid, 0.0)
        used = last.processor_s - first.processor_s
        received = (readers.received - received) if readers else 0
        steps: list[Health] = [item.message for _, item in healths.take()]
        return {
            "pages": pages,
            "slow_pages": slow_pages,
            "seconds": round(elapsed, 1),
            "processor_percent": round(100.0 * used / elapsed, 2),
            "step_p50_ms": round(float(np.median([h.step_p50_ms for h in steps])), 2),
            "step_p99_ms": round(float(np.median([h.step_p99_ms for h in steps])), 2),
            "memory_mb": (round(first.memory_mb, 1), round(last.memory_mb, 1)),
            "received_kb_s": round(received / elapsed / 1e3 / max(pages, 1), 1),
        }
