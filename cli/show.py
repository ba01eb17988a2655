"""`lariat show FILE`: a recording in the dashboard, with a time bar."""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Annotated

import tyro

from dashboard.options import DashboardOptions
from dashboard.outbox import Outbox
from dashboard.page import Page
from dashboard.recordings.player import Player
from dashboard.recordings.timeline import RecordedMessage, Timeline, thin_topic
from dashboard.subscriptions import reads
from dashboard.web.site import Site
from lariat.configuration import refusing
from lariat.trajectory import SECOND
from shared import topics
from shared.recording import Recording
from shared.runtime.live import Stopped, stopping_on_signals
from shared.topics import Topic

PICTURE_PERIOD = SECOND // 10
"""Time between two camera pictures kept in memory [ns]; the page shows no more."""
STEP_PERIOD = 1.0 / 30.0
"""Time between two steps of the player [s]."""
DEFAULT_PAGE = DashboardOptions()
"""Page for this machine only."""


def main(
    file: Path,
    /,
    page: Annotated[DashboardOptions, tyro.conf.arg(name="")] = DEFAULT_PAGE,
) -> int:
    """Show a recording in the browser, with a time bar.

    Examples:
      lariat show recordings/run.mcap --port 8081

    Args:
        file: The MCAP file of a run, whole or cut.
        page: Address of the page, and who may see it.
    """
    recording, timeline = open_timeline(file)
    with tempfile.TemporaryDirectory() as folder:
        with refusing(f"cannot show {file}"):
            scenario = recording.scenario(Path(folder))
        site = Site(page, f"Lariat · {file.name}")
        viser = site.open_viser()
        shown = Page(viser, scenario, Outbox("show"), live=False)
        player = Player(viser, shown, timeline)
        note = f" ({recording.damage})" if recording.damage else ""
        print(
            f"{file}{note}: {(timeline.end - timeline.start) / SECOND:.1f} s at "
            f"{site.address} (Ctrl-C ends)",
            file=sys.stderr,
        )
        try:
            with stopping_on_signals():
                _play(player)
        except Stopped:
            return 0
        finally:
            shown.close()
            site.close()
    return 0


def open_timeline(file: Path) -> tuple[Recording, Timeline]:
    """Recording and the timeline of the topics that the dashboard shows."""
    with refusing(f"cannot show {file}"):
        recording = Recording.open(file)
        with tempfile.TemporaryDirectory() as folder:
            read = reads(recording.scenario(Path(folder)))
        moments = _moments(recording, read)
        for key in (topic.key for topic in read if topics.CAMERA_COLOR.matches(topic.key)):
            moments = thin_topic(moments, key, PICTURE_PERIOD)
        return recording, Timeline(moments, read)


def _moments(recording: Recording, read: Iterable[Topic]) -> Iterator[RecordedMessage]:
    for entry in recording.messages(topic.key for topic in read):
        yield RecordedMessage(
            entry.key, entry.payload, entry.publisher, entry.sequence, entry.log_time
        )


def _play(player: Player) -> None:
    last = time.monotonic()
    while True:
        now = time.monotonic()
        player.step(now - last)
        last = now
        time.sleep(max(0.0, STEP_PERIOD - (time.monotonic() - now)))
