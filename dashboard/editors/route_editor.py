"""Route of a goal: the clips and pegs along which the cable is laid, in their order."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from functools import partial
from typing import Any

import viser

from dashboard import palette
from dashboard.action_queue import ActionQueue
from dashboard.markup import escaped
from lariat.geometry.cable_routes import SIDES_OF_PEGS, clip_openings, legs_of, peg_of
from lariat.geometry.obstacles import Obstacle

NOTHING: str = "–"
"""Entry of a drop-down list without choice."""
MOVES = {"Up": -1, "Down": 1}
"""Displacements of a stop in the order, by the labels of their buttons [-]."""
REMOVE = "Remove"
"""Label of the button that removes a stop."""


class RouteEditor:
    """List of a route's stops, and controls that change it; hidden where there is no clip."""

    def __init__(
        self, gui: viser.GuiApi, actions: ActionQueue, when_changed: Callable[[], None]
    ) -> None:
        self._when_changed = when_changed
        self._visible = False
        self._obstacles: Sequence[Obstacle] = ()
        self._held: Collection[str] = ()
        self.route: tuple[str, ...] = ()
        """Stops, from the left end to the right one; empty for a goal without a route."""
        self._list = gui.add_html("", visible=False)
        self._stop = gui.add_dropdown("Stop", (NOTHING,), visible=False)
        self._moves = gui.add_button_group("", (*MOVES, REMOVE), visible=False)
        self._moves.on_click(
            lambda event: actions.put(lambda move=event.target.value: self._change(move))
        )
        self._new = gui.add_dropdown(
            "New stop",
            (NOTHING,),
            visible=False,
            hint="Clip that holds the cable, or side on which it passes a peg",
        )
        self._add = gui.add_button(
            "Add after the stop", icon=viser.Icon.PLUS, color=palette.NEUTRAL, visible=False
        )
        self._actions = actions
        self._add.on_click(lambda _: self._press_add())

    def show(self, visible: bool) -> None:
        """Show or hide the controls; the list stays as long as there is a route."""
        self._visible = visible
        self._show(len(self.route))

    def take_route(self, route: tuple[str, ...]) -> None:
        """Take the route of a goal."""
        self.route = route
        self._show(len(route))

    def take_scene(self, obstacles: Sequence[Obstacle]) -> None:
        """Take the obstacles among which clips and pegs are chosen."""
        self._obstacles = obstacles
        self._show(self._chosen + 1)

    def mark(self, held: Collection[str]) -> None:
        """Mark the clips that hold the cable at present."""
        if held != self._held:
            self._held = held
            self._list.content = self._html()

    @property
    def _chosen(self) -> int:
        """Index of the chosen stop; -1 without a route."""
        number = self._stop.value.partition(" ")[0]
        return min(int(number) if number.isdigit() else 0, len(self.route)) - 1

    def _show(self, number: int) -> None:
        """Show the route, with a stop chosen by its number from 1 on."""
        clips = clip_openings(self._obstacles)
        legs = {leg for clip in clips for leg in legs_of(clip)}
        pegs = [o.name for o in self._obstacles if o.shape != "half_space" and o.name not in legs]
        named = {peg_of(entry)[0] for entry in self.route}
        free = [name for name in clips if name not in named]
        free += [side + peg for peg in pegs if peg not in named for side in SIDES_OF_PEGS]
        stops = [f"{k} {entry}" for k, entry in enumerate(self.route, 1)]
        _fill(self._new, free, self._new.value)
        _fill(self._stop, stops, stops[max(number, 1) - 1] if stops else NOTHING)
        shown = self._visible and bool(clips)
        for handle in (self._new, self._add):
            handle.visible = shown
        for handle in (self._stop, self._moves):
            handle.visible = shown and bool(stops)
        self._list.visible = bool(stops)
        self._list.content = self._html()

    def _html(self) -> str:
        """HTML of the numbered route."""
        tick = f" <b style='color:{palette.text_css(palette.GOOD)}'>✓ laid</b>"
        rows = "".join(f"<li>{escaped(e)}{tick * (e in self._held)}</li>" for e in self.route)
        return (
            "<div style='margin:.4em 1em;font-size:.9em'>Route, from left to right"
            f"<ol style='margin:.2em 0;padding-left:1.6em;line-height:1.5'>{rows}</ol></div>"
        )

    def _change(self, move: str) -> None:
        stops, k = list(self.route), self._chosen
        if not (self._visible and stops):
            return
        entry = stops.pop(k)
        if move != REMOVE:
            k = min(max(k + MOVES[move], 0), len(stops))
            stops.insert(k, entry)
        self._set(stops, min(k + 1, len(stops)))

    def _press_add(self) -> None:
        """Add what is chosen at present: another choice may come before the next step."""
        self._actions.put(partial(self._insert, self._new.value))

    def _insert(self, entry: str) -> None:
        if self._visible and entry not in (NOTHING, *self.route):
            k = self._chosen + 1
            self._set([*self.route[:k], entry, *self.route[k:]], k + 1)

    def _set(self, stops: Sequence[str], number: int) -> None:
        if tuple(stops) != self.route:
            self.route = tuple(stops)
            self._show(number)
            self._when_changed()


def _fill(handle: Any, options: Sequence[str], value: str) -> None:
    """Give a drop-down list other options, and choose one of them."""
    options = options or (NOTHING,)
    if tuple(handle.options) != tuple(options):
        handle.options = options
    handle.value = value if value in options else options[0]
