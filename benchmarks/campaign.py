"""Campaigns of seeded trials: resumable, on all cores or a Dask cluster, one line per trial.

A specification is a flat frozen dataclass of numbers and words. A trial is a frozen dataclass whose
field `spec` holds it, so that a file of finished trials tells which ones need not be run again.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any, Generic, TypeVar

from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TimeElapsedColumn
from scipy.stats import binomtest

from lariat.configuration import ConfigurationError
from stack.workers import Workers, compute

Spec = TypeVar("Spec")
Trial = TypeVar("Trial")


@dataclass(frozen=True)
class Campaign(Generic[Spec, Trial]):
    """Trials of one kind."""

    run: Callable[[Spec], Trial]
    """Function of a module that runs a trial; it raises ValueError where there is no such scene."""
    restore: Callable[..., Trial]
    """Function that makes a trial of the fields of its dataclass."""
    line: Callable[[Trial], str]
    """Function that states a trial in one line."""

    def trials(
        self,
        specs: Sequence[Spec],
        results: Path | None = None,
        workers: Workers = 1,
        again: bool = False,
    ) -> list[Trial]:
        """Run trials, print a line for each, and return them in the order of their specifications.

        Specifications without a scene are left out.

        Args:
            specs: Trials to run.
            results: File of finished trials, one JSON object a line; trials that it holds are not
                run again.
            workers: Number of processes, or the address of a Dask scheduler.
            again: Run finished trials again.

        Raises:
            ConfigurationError: The file cannot be written, or the cluster cannot be used.
        """
        finished: dict[int, Trial | None] = {}
        for k, row in enumerate(_read(results, specs) if results and not again else ()):
            if row is not None:
                missing = "missing" in row
                finished[k] = None if missing else self.restore(**{**row, "spec": specs[k]})
        open_ones = [k for k in range(len(specs)) if k not in finished]
        attempts = compute(partial(_attempt, self.run), [specs[k] for k in open_ones], workers)
        console = Console(stderr=True, highlight=False, soft_wrap=True)
        # The bar is gone at the end, and never in a file.
        progress = Progress(
            BarColumn(),
            MofNCompleteColumn(),
            TimeElapsedColumn(),
            console=console,
            redirect_stdout=False,
            transient=True,
            disable=not console.is_terminal,
        )
        with progress:
            bar = progress.add_task("", total=len(specs), completed=len(finished))
            for index, trial in attempts:
                spec: Any = specs[open_ones[index]]
                missing = isinstance(trial, str)
                finished[open_ones[index]] = None if missing else trial
                if results:
                    row: Any = {"spec": asdict(spec), "missing": trial} if missing else trial
                    _append(results, row if missing else asdict(row))
                text = trial if missing else self.line(trial)
                progress.console.print(escape(text))
                progress.advance(bar)
        return [trial for k in range(len(specs)) if (trial := finished[k]) is not None]


def success_interval(successes: int, count: int) -> tuple[float, float]:
    """Return the Wilson interval of a rate of success at 95 % confidence."""
    interval = binomtest(successes, count).proportion_ci(method="wilson")
    return float(interval.low), float(interval.high)


def _attempt(run: Callable[[Spec], Trial], spec: Spec) -> Trial | str:
    """Finished trial, or why there is no such scene."""
    try:
        return run(spec)
    except ValueError as missing:
        return str(missing)


def _read(results: Path, specs: Sequence[Any]) -> Iterator[dict[str, Any] | None]:
    """Row of a file for each specification, if it has one; a line that was cut off is left out."""
    rows = {}
    for line in results.read_text().splitlines() if results.exists() else ():
        try:
            row = json.loads(line)
        except ValueError:
            continue
        rows[_key(row["spec"])] = row
    yield from (rows.get(_key(asdict(spec))) for spec in specs)


def _append(results: Path, row: dict[str, Any]) -> None:
    """Write one row on a line of its own, after one that was cut off, too."""
    try:
        results.parent.mkdir(parents=True, exist_ok=True)
        with results.open("a+") as file:
            file.seek(0)
            cut_off = not file.read().endswith("\n") and file.tell() > 0
            file.write("\n" * cut_off + json.dumps(row) + "\n")
    except OSError as error:
        raise ConfigurationError(f"cannot write {results}: {error}") from error


def _key(spec: dict[str, Any]) -> str:
    return json.dumps(spec, sort_keys=True)
