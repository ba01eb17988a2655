"""Player of a recording: time bar, Play and Pause, speed."""

from __future__ import annotations

from math import ceil

import viser

from dashboard import palette
from dashboard.action_queue import ActionQueue
from dashboard.page import Page
from dashboard.recordings.timeline import Timeline
from shared import topics
from lariat.trajectory import SECOND

PLAYBACK_SPEEDS = {"¼ ×": 0.25, "½ ×": 0.5, "1 ×": 1.0, "2 ×": 2.0, "5 ×": 5.0}
"""Seconds of the recording per second of the viewer, by label [-]."""
BAR_PERIOD = 0.1
"""Time between two updates of the time bar during playback [s]."""
BAR_RESOLUTION = 0.01
"""Step of the time bar [s]."""


class Player:
    """Position in a timeline, whose messages the page shows."""

    def __init__(self, server: viser.ViserServer, page: Page, timeline: Timeline) -> None:
        self._page = page
        self._timeline = timeline
        self._actions = ActionQueue()
        self._now = float(timeline.start)
        self._playing = True
        self._speed = 1.0
        self._bar_time = 0.0
        self._viewer_time = 0.0
        self._target: float | None = 0.0
        gui = server.gui
        panel = gui.add_panel()
        with panel.add_tab("Recording", viser.Icon.MOVIE):
            length = ceil(100.0 * max(timeline.end - timeline.start, 1) / SECOND) / 100.0
            self._bar = gui.add_slider("Time [s]", 0.0, length, BAR_RESOLUTION, 0.0)
            self._button = gui.add_button(
                "Pause", icon=viser.Icon.PLAYER_PAUSE, color=palette.BRAND
            )
            speed = gui.add_button_group("Speed", tuple(PLAYBACK_SPEEDS))
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
                lambda value=event.target.value: self.set_speed(PLAYBACK_SPEEDS[value])
            )
        )

    @property
    def seconds(self) -> float:
        """Position in the recording, from its start [s]."""
        return (self._now - self._timeline.start) / SECOND

    def step(self, seconds: float) -> None:
        """Advance by a time of the viewer [s] and update the page."""
        self._actions.run()
        self._page.actions.run()
        self._viewer_time += seconds
        if self._target is not None:
            self._jump(self._target)
        elif self._playing:
            self._now = min(self._now + SECOND * self._speed * seconds, self._timeline.end)
            now = int(self._now)
            self._page.update(self._timeline.advance(now), now)
            if self._now >= self._timeline.end:
                self.play(False)
        if self._playing and self._viewer_time - self._bar_time >= BAR_PERIOD:
            self._bar_time = self._viewer_time
            self._bar.value = round(self.seconds, 2)

    def seek(self, seconds: float) -> None:
        """Pause, and jump to a time from the start [s] with the next step."""
        self._target = seconds
        self._show_state(False)

    def play(self, playing: bool) -> None:
        """Play or pause."""
        self._show_state(playing)
        self._bar.value = round(self.seconds, 2)

    def set_speed(self, factor: float) -> None:
        """Set the seconds of the recording per second of the viewer [-]."""
        self._speed = factor

    def _jump(self, seconds: float) -> None:
        self._target = None
        start, end = self._timeline.start, self._timeline.end
        self._now = min(max(start + SECOND * seconds, start), end)
        now = int(self._now)
        self._page.clear_history()
        for task in self._timeline.past(topics.TASK_STATE, now):
            self._page.add_history(task)
        for parameters in self._timeline.past(topics.CONTROLLER_PARAMETERS, now):
            self._page.add_history(parameters)
        inbox = self._timeline.jump(now)
        self._page.hide_unknown(inbox)
        self._page.update(inbox, now)

    def _toggle(self) -> None:
        if not self._playing and self._now >= self._timeline.end:
            self._target = 0.0
        self.play(not self._playing)

    def _show_state(self, playing: bool) -> None:
        self._playing = playing
        self._button.label = "Pause" if playing else "Play"
        self._button.icon = viser.Icon.PLAYER_PAUSE if playing else viser.Icon.PLAYER_PLAY
