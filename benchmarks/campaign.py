"""Campaigns of seeded trials: resumable, in one or several processes, one line per trial.

A specification is a flat frozen dataclass of numbers and words. A trial is a frozen dataclass whose
field `spec` holds it, so that a file of finished trials tells which ones need not be run again.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any, Generic, TypeVar

from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TimeElapsedColumn
from scipy.stats import binomtest

from benchmarks import worker_pool
from benchmarks.worker_pool import Workers
from lariat.configuration import ConfigurationError

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
            ConfigurationError: The file cannot be written.
        """
        finished: dict[int, Trial | None] = {}
        rows = {} if again else _read(results)
        if rows:
            keys = map(_key, map(asdict, specs))  # pyright: ignore[reportArgumentType]
            restored = ((k, rows[key]) for k, key in enumerate(keys) if key in rows)
            finished = {k: self._restored(specs[k], row) for k, row in restored}
        open_ones = [k for k in range(len(specs)) if k not in finished]
        attempts = worker_pool.compute(
            partial(_attempt, self.run), [specs[k] for k in open_ones], workers
        )
        columns = BarColumn(), MofNCompleteColumn(), TimeElapsedColumn()
        console = Console(stderr=True, highlight=False, soft_wrap=True)
        # The bar is gone at the end, and never in a file.
        progress = Progress(
            *columns,
            console=console,
            redirect_stdout=False,
            transient=True,
            disable=not console.is_terminal,
        )
        with progress:
            bar = progress.add_task("", total=len(specs), completed=len(finished))
            for index, trial in attempts:
                spec = specs[open_ones[index]]
                finished[open_ones[index]] = None if isinstance(trial, str) else trial
                if results and isinstance(trial, str):
                    _append(results, {"spec": asdict(spec), "missing": trial})  # pyright: ignore[reportArgumentType]
                elif results:
                    _append(results, asdict(trial))  # pyright: ignore[reportArgumentType]
                text = trial if isinstance(trial, str) else self.line(trial)
                progress.console.print(escape(text))
                progress.advance(bar)
        return [trial for k in range(len(specs)) if (trial := finished[k]) is not None]

    def _restored(self, spec: Spec, row: dict[str, Any]) -> Trial | None:
        """Trial of a row of the file; None where there was no scene."""
        if "missing" in row:
            return None
        return self.restore(**{**row, "spec": spec})


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


def _read(results: Path | None) -> dict[str, dict[str, Any]]:
    """Rows of a file by their specification; a line that was cut off is left out."""
    rows = {}
    for line in results.read_text().splitlines() if results and results.exists() else ():
        try:
            row = json.loads(line)
        except ValueError:
            continue
        rows[_key(row["spec"])] = row
    return rows


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
