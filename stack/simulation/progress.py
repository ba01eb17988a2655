"""Progress of simulated runs, on standard error, or in place in the output of a notebook's cell."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from io import StringIO
from typing import TYPE_CHECKING

from lariat.scenario import Scenario
from lariat.trajectory import SECOND
from shared import topics
from shared.messages import RunState

if TYPE_CHECKING:
    from rich.progress import Progress, ProgressColumn

    from stack.simulation.scoring import Scorer
    from stack.simulation.simulated_time import SimulatedStack

PROGRESS_PERIOD = 0.1
"""Time between two updates of a progress bar [s]."""
NOTEBOOK_WIDTH = 100
"""Width of a progress bar in a notebook [characters]."""

Watch = Callable[["SimulatedStack", "Scorer"], None]
"""Observer of a run, called once per `POLL_PERIOD`."""


@contextmanager
def run_progress(scenario: Scenario) -> Iterator[Watch]:
    """Show the progress of a run that calls the observer."""
    from rich.progress import BarColumn, TextColumn, TimeElapsedColumn

    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.completed:5.1f} of {task.total:g} s  {task.fields[seen]}"),
        TimeElapsedColumn(),
    )
    shown = 0.0
    with _shown(*columns) as (progress, draw):
        bar = progress.add_task("Warming up", total=scenario.run.time_limit, seen="")
        draw()

        def watch(stack: SimulatedStack, scorer: Scorer) -> None:
            nonlocal shown
            if time.monotonic() - shown < PROGRESS_PERIOD:
                return
            shown = time.monotonic()
            task = stack.latest(topics.TASK_STATE)
            progress.update(
                bar,
                description=RunState.Name(task.state).capitalize() if task else "Starting",
                completed=(stack.now - scorer.started) / SECOND if scorer.started else 0.0,
                seen=f"error {1e3 * task.error:.1f} mm  clearance {1e3 * task.clearance:.0f} mm"
                if task and scorer.started
                else "",
            )
            draw()

        yield watch


@contextmanager
def count_progress(total: int) -> Iterator[Callable[[], None]]:
    """Show how many of several runs are over; the function counts one more."""
    from rich.progress import BarColumn, MofNCompleteColumn, TimeElapsedColumn

    with _shown(BarColumn(), MofNCompleteColumn(), TimeElapsedColumn()) as (progress, draw):
        bar = progress.add_task("", total=total)
        draw()

        def advance() -> None:
            progress.advance(bar)
            draw()

        yield advance


@contextmanager
def _shown(*columns: ProgressColumn) -> Iterator[tuple[Progress, Callable[[], None]]]:
    """Show a bar that disappears at the end, and the function that draws it in a notebook.

    rich draws in a notebook through ipywidgets, which not every one has.
    """
    from rich.console import Console
    from rich.progress import Progress

    console = Console(stderr=True, highlight=False)
    if not console.is_jupyter:
        with Progress(
            *columns, console=console, transient=True, redirect_stdout=False, redirect_stderr=False
        ) as progress:
            yield progress, lambda: None
        return
    from IPython.display import display  # pyright: ignore[reportMissingImports]

    progress = Progress(*columns, disable=True)
    place = display({"text/plain": ""}, raw=True, display_id=True)

    def draw() -> None:
        text = StringIO()
        Console(file=text, width=NOTEBOOK_WIDTH, force_jupyter=False).print(
            *progress.get_renderables()
        )
        place.update({"text/plain": text.getvalue().rstrip()}, raw=True)

    try:
        yield progress, draw
    finally:
        place.update({"text/plain": ""}, raw=True)
