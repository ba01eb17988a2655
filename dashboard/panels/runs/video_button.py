"""Button that has the recorder make a video of a run, and hands it to the browser that asked."""

from __future__ import annotations

from collections.abc import Callable

import viser

from dashboard.action_queue import ActionQueue
from dashboard.outbox import Notification, Outbox
from shared.messages import RunListRequest, RunVideo

LABEL = "Make video (MP4)"
"""Label while no video is being made."""


class VideoButton:
    """Button with the progress of the video on it; pressed meanwhile, it cancels the video."""

    def __init__(
        self,
        gui: viser.GuiApi,
        actions: ActionQueue,
        outbox: Outbox,
        notify: Callable[[Notification], None],
    ) -> None:
        self._outbox, self._notify = outbox, notify
        self._asked: tuple[str, viser.ClientHandle | None] = "", None
        """Run of which a browser has asked for a video, and that browser."""
        self._run = ""
        """Run that is selected and has a recording; empty without one."""
        self._made = ""
        """Run whose video is being made."""
        self._button = gui.add_button(
            LABEL,
            icon=viser.Icon.VIDEO,
            disabled=True,
            hint="Drawn from the recording while the cell goes on, then downloaded",
        )
        actions.on_press(self._button, self._press)

    def select(self, run: str) -> None:
        """Take the run that is selected; empty where none is, or where it has no recording."""
        self._run = run
        self._show(self._button.label)

    def take(self, video: RunVideo) -> None:
        """Show how far a video is, and send it to the browser that asked for it."""
        self._made = "" if video.data or video.failure else video.run
        self._show(f"Video: {100.0 * video.progress:.0f} % (cancel)" if self._made else LABEL)
        if self._made:
            return
        (run, client), self._asked = self._asked, ("", None)
        if video.failure:
            self._notify(Notification(f"No video of {video.run}", video.failure))
        elif client is not None and run == video.run:
            client.send_file_download(f"{video.run}.mp4", video.data, save_immediately=True)

    def _press(self, client: viser.ClientHandle) -> None:
        if self._made:
            self._outbox.request_runs(RunListRequest.CANCEL_VIDEO, [self._made], "Cancel video")
        elif self._run:
            self._asked = self._run, client
            self._outbox.request_runs(RunListRequest.MAKE_VIDEO, [self._run], "Make video")

    def _show(self, label: str) -> None:
        self._button.label = label
        self._button.disabled = not (self._run or self._made)
