"""Recorded run that is looked at beside the present cell: time bar, marks, rope and picture."""

from __future__ import annotations

import math
import threading

import cv2
import numpy as np
import viser
from jaxtyping import Float64, UInt8

from dashboard import palette
from dashboard.action_queue import ActionQueue
from dashboard.markup import escaped
from dashboard.outbox import Outbox
from dashboard.panels.camera_image import decode
from dashboard.scene.tube_view import TubeView
from lariat.scenario import Scenario
from lariat.trajectory import SECOND
from shared.messages import RunListRequest, RunMotion, RunPicture, chain

PICTURE_PERIOD = SECOND // 4
"""Least time between two requests for pictures [ns]."""
BAR_PERIOD = SECOND // 10
"""Time between two updates of the time bar during playback [ns]."""
BAR_STEP = 0.02
"""Step of the time bar [s]."""
EXPORTED_SHAPES = 150
"""Most shapes of a saved scene [-]."""


class OpenedRun:
    """Rope of a recorded run in the scene, at the time that a bar shows."""

    def __init__(
        self,
        server: viser.ViserServer,
        scenario: Scenario,
        actions: ActionQueue,
        outbox: Outbox,
    ) -> None:
        self._server, self._actions, self._outbox = server, actions, outbox
        radius = scenario.rope.diameter / 2.0
        self._rope = TubeView(server.scene, "/opened/rope", 1.05 * radius, opacity=0.75)
        self._goal = TubeView(server.scene, "/opened/goal", 0.6 * radius, opacity=0.4)
        self._id = ""
        self._motion: RunMotion | None = None
        self._shapes: Float64[np.ndarray, "k n 3"] = np.zeros((0, 0, 3))
        self._seconds = 0.0
        self._playing = False
        self._step_time = self._bar_time = self._picture_time = 0
        self._picture_wanted = False
        self._picture: UInt8[np.ndarray, "h w 3"] | None = None
        gui = server.gui
        self._folder = gui.add_folder("Opened run", visible=False)
        self._bar: viser.GuiSliderHandle[float] | None = None
        with self._folder:
            self._title = gui.add_html("")
            self._play = gui.add_button("Play", icon=viser.Icon.PLAYER_PLAY)
            self._image = gui.add_image(np.zeros((8, 8, 3), np.uint8), visible=False)
            self._save_picture = gui.add_button(
                "Save picture (PNG)", icon=viser.Icon.PHOTO, disabled=True
            )
            self._save_scene = gui.add_button(
                "Save scene (HTML)",
                icon=viser.Icon.DOWNLOAD,
                hint="One file with the scene and the run's motion, for any browser",
            )
            close = gui.add_button("Close", icon=viser.Icon.X, color=palette.NEUTRAL)
        self._play.on_click(lambda _: actions.put(self._toggle))
        close.on_click(lambda _: actions.put(self.close))
        actions.on_press(self._save_picture, self._send_picture)
        actions.on_press(self._save_scene, self._send_scene)

    def open(self, id: str) -> None:
        """Ask the recorder for the motion of a run."""
        self.close()
        self._id = id
        self._outbox.request_runs(RunListRequest.SEND_MOTION, [id], "Open")

    def close(self) -> None:
        """Remove the run from the scene."""
        self._id, self._motion, self._playing = "", None, False
        self._play.label = "Play"
        self._folder.visible = False
        self._rope.hide()
        self._goal.hide()
        if self._bar is not None:
            self._bar.remove()
            self._bar = None

    def take_motion(self, motion: RunMotion) -> None:
        """Show a motion that was asked for, from its beginning."""
        if motion.run != self._id or self._motion is not None:
            return
        self._motion = motion
        count = max(motion.node_count, 1)
        self._shapes = np.array(motion.nodes, float).reshape(-1, count, 3)
        if len(goal := chain(motion.goal)) > 1:
            self._goal.show(goal, palette.OPENED_RUN)
        self._title.content = marks_html(motion)
        self._add_bar(motion)
        self._image.visible = False
        self._save_picture.disabled = True
        self._play.disabled = self._save_scene.disabled = not len(self._shapes)
        self._folder.visible = True
        self._seek(motion.time[0] if motion.time else 0.0)

    def take_picture(self, picture: RunPicture) -> None:
        """Show a picture that was asked for."""
        if self._motion is None or picture.run != self._id:
            return
        self._picture = decode(picture.data) if picture.data else None
        if self._picture is not None:
            self._image.image = self._picture
        self._image.visible = self._picture is not None
        self._save_picture.disabled = self._picture is None

    def update(self, now: int) -> None:
        """Play on, and ask for the picture of the shown time."""
        elapsed, self._step_time = (now - self._step_time) / SECOND, now
        if self._motion is None:
            return
        if self._playing and self._motion.time:
            end = self._motion.time[-1]
            self._seek(min(self._seconds + elapsed, end))
            if now - self._bar_time >= BAR_PERIOD and self._bar is not None:
                self._bar_time = now
                self._bar.value = round(self._seconds, 2)
            if self._seconds >= end:
                self._toggle()
        if self._picture_wanted and now - self._picture_time >= PICTURE_PERIOD:
            self._picture_wanted, self._picture_time = False, now
            # Without a label: a picture that does not come is no news for a person.
            self._outbox.request_runs(
                RunListRequest.SEND_PICTURE, [self._id], "", time=self._seconds
            )

    def _add_bar(self, motion: RunMotion) -> None:
        # Two decimals: the field beside the bar has no room for more.
        start, end = (round(motion.time[k], 2) if motion.time else 0.0 for k in (0, -1))
        # Marks outside of the motion, and marks that would cover one another, are in the list only.
        marks, last = [], -math.inf
        for mark in motion.marks:
            if start <= mark.time <= end and mark.time - last > 0.15 * (end - start):
                marks.append((mark.time, mark.text.partition(":")[0]))
                last = mark.time
        with self._folder:
            self._bar = self._server.gui.add_slider(
                "Time [s]",
                start,
                max(end, start + BAR_STEP),
                BAR_STEP,
                start,
                marks=tuple(marks) or None,
                order=self._play.order - 0.5,
            )
        self._actions.on_change(self._bar, self._take_bar)

    def _take_bar(self, seconds: float) -> None:
        if self._playing:
            self._toggle()
        self._seek(seconds)

    def _seek(self, seconds: float) -> None:
        self._seconds = seconds
        self._picture_wanted = True
        if self._motion is not None and len(self._shapes):
            index = max(int(np.searchsorted(self._motion.time, seconds + 1e-6)) - 1, 0)
            self._rope.show(self._shapes[index], palette.OPENED_RUN)

    def _toggle(self) -> None:
        if self._motion is None or not self._motion.time:
            return
        self._playing = not self._playing
        if self._playing and self._seconds >= self._motion.time[-1]:
            self._seek(self._motion.time[0])
        self._play.label = "Pause" if self._playing else "Play"

    def _send_picture(self, client: viser.ClientHandle) -> None:
        if self._picture is not None:
            image = cv2.cvtColor(self._picture, cv2.COLOR_RGB2BGR)
            content = cv2.imencode(".png", image)[1].tobytes()
            client.send_file_download(
                f"{self._id}-{self._seconds:.2f}s.png", content, save_immediately=True
            )

    def _send_scene(self, client: viser.ClientHandle) -> None:
        """Send the scene with the run's motion as one HTML file."""
        if self._motion is None:
            return
        name, times = f"{self._id}.html", np.array(self._motion.time)
        serializer = self._server.get_scene_serializer()
        indices = np.unique(np.linspace(0, len(times) - 1, EXPORTED_SHAPES).astype(int))
        for index, duration in zip(indices, np.diff(times[indices], append=times[-1]), strict=True):
            self._rope.show(self._shapes[index], palette.OPENED_RUN)
            serializer.insert_sleep(float(duration))
        self._seek(self._seconds)

        def send() -> None:
            content = serializer.as_html(dark_mode=True).encode()
            client.send_file_download(name, content, save_immediately=True)

        # Compressing takes seconds, which the page must not stand still for.
        threading.Thread(target=send, name="saved scene", daemon=True).start()


def marks_html(motion: RunMotion) -> str:
    """HTML list of what happened in a run."""
    rows = "".join(
        f"<tr><td style='text-align:right;white-space:nowrap'>{mark.time:.2f} s</td>"
        f"<td>{escaped(mark.text)}</td></tr>"
        for mark in motion.marks
    )
    style = "font-size:.8em;border-spacing:.6em .2em;font-variant-numeric:tabular-nums"
    head = f"<div style='font-size:.85em;margin:.3em .6em'>{escaped(motion.run)}</div>"
    body = (
        f"<div style='max-height:120px;overflow:auto'><table style='{style}'>{rows}</table></div>"
    )
    return head + body
