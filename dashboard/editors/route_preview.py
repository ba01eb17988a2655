"""Preview of a cable that is laid along a route, computed in a process of its own."""

from __future__ import annotations

import multiprocessing
import os
import signal
from collections.abc import Sequence
from contextlib import suppress
from multiprocessing.connection import Connection

from lariat.geometry.obstacles import Obstacle
from lariat.kernel_cache.source import NoCompilerError
from lariat.scenario import Scenario, Shape
from shared.messages import GoalPreview, goal_message

NICENESS = 10
"""Niceness of the process, which leaves the processors to the cell [-]."""


class RoutePreview:
    """Process that lays the model's cable; neither a step nor a hold waits for it."""

    def __init__(self, scenario: Scenario) -> None:
        """Preview cables of a cell; the process begins with the first request."""
        self._scenario = scenario
        self._pipe: Connection | None = None
        self._present = ""
        """Draft that is being computed; empty for none."""
        self._next: tuple[str, Shape, Sequence[Obstacle]] | None = None

    def request(self, draft: str, shape: Shape, obstacles: Sequence[Obstacle]) -> None:
        """Request the preview of a draft in the place of all before it."""
        self._next = draft, shape, obstacles

    def news(self) -> str | GoalPreview | None:
        """Return what is being done, in words, or an answer; None where there is nothing new.

        EOFError: the process has died; another one begins with the next request.
        """
        if self._next is not None and not self._present:
            (self._present, *_), request, self._next = self._next, self._next, None
            self._pipe = self._pipe or self._started()
            self._pipe.send(request)
        if self._pipe is None or not self._pipe.poll():
            return None
        try:
            news = self._pipe.recv()
        except (EOFError, OSError):
            self._pipe, self._present = None, ""
            raise
        if isinstance(news, GoalPreview):
            self._present = ""
        return news

    def _started(self) -> Connection:
        # Not forked: a copy of threads and sockets does not work.
        context = multiprocessing.get_context("spawn")
        here, there = context.Pipe()
        context.Process(target=_answer, args=(self._scenario, there), daemon=True).start()
        there.close()
        return here


def _answer(scenario: Scenario, pipe: Connection) -> None:
    """Answer requests until the page ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    os.nice(NICENESS)
    with suppress(EOFError, OSError):
        while True:
            draft, shape, obstacles = pipe.recv()
            try:
                # Imported late: the rod starts a compiler, which the page does not need.
                from lariat.control.run.requests import route_preview

                preview = route_preview(scenario, shape, obstacles, pipe.send)
            except (ImportError, NoCompilerError) as error:
                reason = f"the page's computer has no rod ({error}); use `lariat goal` elsewhere"
                pipe.send(GoalPreview(draft=draft, reason=reason))
                continue
            answer = GoalPreview(draft=draft, reason=preview.problem)
            answer.reachable = preview.goal is not None and not preview.problem
            if preview.goal is not None:
                answer.goal.CopyFrom(goal_message(preview.goal))
            pipe.send(answer)
