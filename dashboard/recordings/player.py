"""A recording on the page: a time bar, play, speed."""

from __future__ import annotations

from math import ceil

import viser

from dashboard import palette
from dashboard.action_queue import Actions
from dashboard.page import Page
from dashboard.recordings.timeline import Timeline
from shared import topics
from shared.service import SECOND

SPEEDS = {"¼ ×": 0.25, "½ ×": 0.5, "1 ×": 1.0, "2 ×": 2.0, "5 ×": 5.0}
BAR_PERIOD = 0.1
"""Between two movements of the bar while it plays [s]."""


class Player:
    """Moves through a timeline and shows on the page what was known there."""

    def __init__(self, server: viser.ViserServer, page: Page, timeline: Timeline) -> None:
        self._page = page
        self._timeline = timeline
        self._actions = Actions()
        self._now = float(timeline.start)
        self._playing = True
        self._speed = 1.0
        self._bar_moved = 0.0
        self._elapsed = 0.0
        self._sought: float | None = 0.0
        gui = server.gui
        panel = gui.add_panel()
        with panel.add_tab("Recording", viser.Icon.MOVIE):
            length = ceil(100.0 * max(timeline.end - timeline.start, 1) / SECOND) / 100.0
            self._bar = gui.add_slider("Time [s]", 0.0, length, 0.01, 0.0)
            self._button = gui.add_button(
                "Pause", icon=viser.Icon.PLAYER_PAUSE, color=palette.BRAND
            )
            speed = gui.add_button_group("Speed", tuple(SPEEDS))
        panel.float(x=30, y=-20, width=520)
        self._bar.on_update(
            lambda event: (
                event.client is not None
                and self._actions.put(lambda value=event.target.value: self.seek(value))
            )
        )
        self._button.on_click(lambda _: self._actions.put(self._toggle))
        speed.on_click(
            lambda event: self._actions.put(
                lambda value=event.target.value: self.set_speed(SPEEDS[value])
            )
        )

    @property
    def seconds(self) -> float:
        """Where the recording stands, from its start [s]."""
        return (self._now - self._timeline.start) / SECOND

    def step(self, seconds: float) -> None:
        """Shows what there is some time of the viewer's later [s]."""
        for action in self._actions.take():
            action()
        self._page.act()
        self._elapsed += seconds
        if self._sought is not None:
            self._jump(self._sought)
        elif self._playing:
            self._now = min(self._now + SECOND * self._speed * seconds, self._timeline.end)
            now = int(self._now)
            self._page.show(self._timeline.advance(now), now)
            if self._now >= self._timeline.end:
                self.play(False)
        if self._playing and self._elapsed - self._bar_moved >= BAR_PERIOD:
            self._bar_moved = self._elapsed
            self._bar.value = round(self.seconds, 2)

    def seek(self, seconds: float) -> None:
        """Stands still at a time from the start [s], with the next step."""
        self._sought = seconds
        self._show_state(False)

    def play(self, on: bool) -> None:
        """Goes on or stands still."""
        self._show_state(on)
        self._bar.value = round(self.seconds, 2)

    def set_speed(self, factor: float) -> None:
        """Seconds of the recording in a second of the viewer's."""
        self._speed = factor

    def _jump(self, seconds: float) -> None:
        self._sought = None
        start, end = self._timeline.start, self._timeline.end
        self._now = min(max(start + SECOND * seconds, start), end)
        now = int(self._now)
        self._page.forget()
        for task in self._timeline.past(topics.TASK_STATE, now):
            self._page.remember(task)
        for parameters in self._timeline.past(topics.CONTROLLER_PARAMETERS, now):
            self._page.remember(parameters)
        self._page.show(self._timeline.jump(now), now)

    def _toggle(self) -> None:
        if not self._playing and self._now >= self._timeline.end:
            self._sought = 0.0
        self.play(not self._playing)

    def _show_state(self, playing: bool) -> None:
        self._playing = playing
        self._button.label = "Pause" if playing else "Play"
        self._button.icon = viser.Icon.PLAYER_PAUSE if playing else viser.Icon.PLAYER_PLAY
