"""Progress of simulated runs, on standard error."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from lariat.scenario import Scenario
from lariat.trajectory import SECOND
from shared import topics
from shared.messages import RunState

if TYPE_CHECKING:
    from rich.console import Console

    from stack.simulation.scoring import Scorer
    from stack.simulation.simulated_time import SimulatedStack

PROGRESS_PERIOD = 0.1
"""Time between two updates of a progress bar [s]."""

Watch = Callable[["SimulatedStack", "Scorer"], None]
"""Observer of a run, called once per `POLL_PERIOD`."""


def console() -> Console:
    """Return the console of standard error; a notebook takes the codes of a terminal."""
    from rich.console import Console

    plain = Console(stderr=True, highlight=False)
    if plain.is_jupyter:
        return Console(stderr=True, highlight=False, force_jupyter=False, force_terminal=True)
    return plain


@contextmanager
def run_progress(scenario: Scenario) -> Iterator[Watch]:
    """Show the progress of a run that calls the observer."""
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.completed:5.1f} of {task.total:g} s  {task.fields[seen]}"),
        TimeElapsedColumn(),
    )
    shown = 0.0
    with Progress(
        *columns, console=console(), transient=True, redirect_stdout=False, redirect_stderr=False
    ) as progress:
        bar = progress.add_task("Warming up", total=scenario.run.time_limit, seen="")

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

        yield watch


@contextmanager
def count_progress(total: int) -> Iterator[Callable[[], None]]:
    """Show how many of several runs are over; the function counts one more."""
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TimeElapsedColumn

    columns = BarColumn(), MofNCompleteColumn(), TimeElapsedColumn()
    with Progress(*columns, console=console(), redirect_stdout=False, transient=True) as progress:
        bar = progress.add_task("", total=total)
        yield lambda: progress.advance(bar)
