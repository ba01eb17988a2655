"""Runs that the recorder has kept: compare, note, star, export, delete."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
import viser

from dashboard.action_queue import ActionQueue
from dashboard.markup import paragraph_html
from dashboard.outbox import Notification, Outbox
from dashboard.panels.chart import Curve, add_comparison_chart
from dashboard.panels.runs.opened_run import OpenedRun
from dashboard.panels.runs.run_table import csv_text, detail_html, label, matching, table_html
from dashboard.panels.runs.video_button import VideoButton
from lariat.scenario import Scenario
from lariat.trajectory import SECOND
from shared.messages import (
    RunCurves,
    RunList,
    RunListRequest,
    RunSummary,
)

NO_RUN = "(none)"
"""Option of the selection that stands for no run."""
NOTE_DELAY = SECOND
"""Time after the last change of a note until it is sent [ns]."""
MAX_COMPARED = 6
"""Largest number of runs that are drawn together [-]."""


@dataclass
class _TypedNote:
    """Note that a person is typing."""

    run: str
    """Id of its run."""
    text: str
    """Text so far."""
    since: int = 0
    """Time of the first step that has seen this text [ns]."""


class RunsPanel:
    """Table of runs, one of which is selected, and the curves of those that are compared."""

    def __init__(
        self,
        server: viser.ViserServer,
        scenario: Scenario,
        actions: ActionQueue,
        outbox: Outbox,
        notify: Callable[[Notification], None],
    ) -> None:
        self._gui = gui = server.gui
        self._outbox, self._notify = outbox, notify
        self._shown_curves: list[tuple[str, str]] | None = None
        """Id and label of each run that the charts show; None before the first drawing."""
        self._runs: dict[str, RunSummary] = {}
        self._ids: dict[str, str] = {}
        """Ids of the runs by their labels."""
        self._selected = ""
        self._compared: list[str] = []
        self._curves: dict[str, RunCurves] = {}
        self._downloads: dict[str, list[viser.ClientHandle]] = {}
        self._typed: _TypedNote | None = None
        self._stamp = -1
        self._filter = gui.add_text(
            "Show", "", hint="Words of scenario, verdict, note (a campaign's name) or ★; empty: all"
        )
        self._filter.on_update(lambda _: actions.put(self._show_options))
        self._table = gui.add_html(table_html((), ()))
        self._selection = gui.add_dropdown("Run", (NO_RUN,))
        actions.on_change(self._selection, lambda name: self._select(self._ids.get(name, "")))
        self._detail = gui.add_html("")
        self._open = gui.add_button(
            "Open run",
            icon=viser.Icon.MOVIE,
            disabled=True,
            hint="Show the recorded rope beside the present one, at any time of the run",
        )
        self._open.on_click(lambda _: actions.put(lambda: self.opened.open(self._selected)))
        # Below its button: further down, it would open where nobody looks.
        self.opened = OpenedRun(server, scenario, actions, outbox)
        self._compare = gui.add_button("Compare", icon=viser.Icon.CHART_LINE, disabled=True)
        self._compare.on_click(lambda _: actions.put(self._toggle_compared))
        self._compare_shown = gui.add_button(
            "Compare the shown ones",
            icon=viser.Icon.CHART_DOTS,
            disabled=True,
            hint=f"Curves of the runs of the table, the newest {MAX_COMPARED}, and of no other",
        )
        self._compare_shown.on_click(lambda _: actions.put(self._compare_all_shown))
        self._star = gui.add_button("Star", icon=viser.Icon.STAR, disabled=True)
        self._star.on_click(lambda _: actions.put(self._toggle_star))
        self._note = gui.add_text("Note", "", disabled=True)
        actions.on_change(self._note, self._take_note)
        self._export = gui.add_button("Export CSV", icon=viser.Icon.DOWNLOAD, disabled=True)
        actions.on_press(self._export, self._request_export)
        self.video = VideoButton(gui, actions, outbox, notify)
        self._delete = gui.add_button("Delete …", icon=viser.Icon.TRASH, disabled=True)
        actions.on_press(self._delete, self._confirm)
        self._actions = actions
        self._charts = gui.add_folder("Compared runs")
        self._drawn: tuple[viser.GuiUplotHandle, ...] = ()
        self._draw()

    def update(self, runs: RunList | None, now: int) -> None:
        """Show the recorder's list, and send a note that a person has finished typing."""
        self._send_note(now)
        self.opened.update(now)
        if runs is None or runs.stamp == self._stamp:
            return
        self._stamp = runs.stamp
        by_id = {run.id: run for run in runs.runs}
        if by_id == self._runs:
            return
        self._runs = by_id
        self._ids = {label(run): run.id for run in runs.runs}
        self._compared = [id for id in self._compared if id in by_id]
        self._show_options()
        self._draw()

    def take_curves(self, curves: RunCurves) -> None:
        """Take curves that were requested, to draw or to download them."""
        self._curves[curves.run] = curves
        for client in self._downloads.pop(curves.run, ()):
            text = csv_text(curves.time, curves.error, curves.clearance)
            client.send_file_download(f"{curves.run}.csv", text.encode(), save_immediately=True)
        self._draw()

    def _shown(self) -> list[RunSummary]:
        return matching(self._runs.values(), self._filter.value)

    def _show_options(self) -> None:
        """Offer the runs that the filter shows; the selected one stays among them."""
        shown = self._shown()
        if (run := self._runs.get(self._selected)) and run not in shown:
            shown.append(run)
        options = (NO_RUN, *map(label, shown))
        if tuple(self._selection.options) != options:
            self._selection.options = options  # pyright: ignore[reportAttributeAccessIssue]
        self._compare_shown.disabled = not self._shown()
        self._select(self._selected)

    def _select(self, id: str) -> None:
        run = self._runs.get(id)
        changed, self._selected = id != self._selected, id if run else ""
        self._selection.value = label(run) if run else NO_RUN  # pyright: ignore[reportAttributeAccessIssue]
        for handle in (self._compare, self._star, self._note, self._export, self._delete):
            handle.disabled = run is None
        recorded = run is not None and run.over and run.bytes > 0
        self._open.disabled = not recorded
        self.video.select(id if recorded else "")
        self._detail.content = detail_html(run)
        self._star.label = "Remove the star" if run and run.star else "Star"
        self._compare.label = "Compare no more" if id and id in self._compared else "Compare"
        if changed:
            self._note.value = run.note if run else ""
        self._show_table()

    def _show_table(self) -> None:
        selected = {self._selected, *self._compared}
        self._table.content = table_html(self._shown(), selected)

    def _toggle_compared(self) -> None:
        if not (id := self._selected):
            return
        if id in self._compared:
            self._compared.remove(id)
        elif len(self._compared) == MAX_COMPARED:
            text = f"{MAX_COMPARED} runs are drawn together at most; take one out first."
            self._notify(Notification("Compare", text))
            return
        else:
            self._compared.append(id)
            self._request_curves(id)
        self._select(id)
        self._draw()

    def _compare_all_shown(self) -> None:
        self._compared = [run.id for run in self._shown()[:MAX_COMPARED]]
        if self._compared:
            self._request_curves(*self._compared)
        self._select(self._selected)
        self._draw()

    def _request_curves(self, *ids: str) -> None:
        self._outbox.request_runs(RunListRequest.SEND_CURVES, ids, "Curves")

    def _request_export(self, client: viser.ClientHandle) -> None:
        if self._selected:
            self._downloads.setdefault(self._selected, []).append(client)
            self._request_curves(self._selected)

    def _toggle_star(self) -> None:
        if run := self._runs.get(self._selected):
            self._annotate(run, run.note, not run.star)

    def _take_note(self, text: str) -> None:
        self._typed = _TypedNote(self._selected, text)

    def _send_note(self, now: int) -> None:
        """Send the note once nothing has been typed for a while, or another run is selected."""
        typed = self._typed
        if typed is None:
            return
        typed.since = typed.since or now
        if now - typed.since < NOTE_DELAY and typed.run == self._selected:
            return
        self._typed = None
        if run := self._runs.get(typed.run):
            self._annotate(run, typed.text, run.star)

    def _annotate(self, run: RunSummary, note: str, star: bool) -> None:
        fields = {"note": note, "star": star}
        self._outbox.request_runs(RunListRequest.ANNOTATE, [run.id], "Note", **fields)

    def _confirm(self, client: viser.ClientHandle) -> None:
        """Ask in the window where deleting was pressed: a recording does not come back."""
        run = self._runs.get(self._selected)
        if run is None:
            return
        text = f"{label(run)} and its recording of {run.bytes / 1e6:.1f} MB."
        request = partial(self._outbox.request_runs, RunListRequest.DELETE, [run.id], "Delete")
        self._actions.confirm(client, "Delete this run?", [paragraph_html(text)], "Delete", request)

    def _draw(self) -> None:
        loaded: Sequence[RunCurves] = [
            self._curves[id] for id in self._compared if id in self._curves
        ]
        shown = [(curves.run, label(self._runs[curves.run])) for curves in loaded]
        if shown == self._shown_curves:
            return
        self._shown_curves = shown
        for chart in self._drawn:
            chart.remove()
        with self._charts:
            self._drawn = tuple(
                add_comparison_chart(
                    self._gui,
                    f"{column.capitalize()} [mm]",
                    [name for _, name in shown],
                    [_curve(curves, column) for curves in loaded],
                )
                for column in ("error", "clearance")
            )


def _curve(curves: RunCurves, column: str) -> Curve:
    """Curve of a run in mm, without values that are none."""
    values = np.array(getattr(curves, column))
    return np.array(curves.time), np.where(values < 0.0, np.nan, 1e3 * values)
