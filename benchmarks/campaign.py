"""Campaigns of seeded trials: resumable, on all cores or a Dask cluster, one line per trial.

A specification is a flat frozen dataclass of numbers and words. A trial is a dictionary of figures,
or a frozen dataclass, with its specification as `spec`, so that a file of finished trials tells
which ones need not be run again.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any, Generic, TypeAlias, TypeVar

from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TimeElapsedColumn
from scipy.stats import binomtest

from benchmarks.tables import PrintOptions
from lariat.configuration import ConfigurationError
from stack.workers import Workers, compute

Spec = TypeVar("Spec")
AnyTrial = TypeVar("AnyTrial")
Trial: TypeAlias = dict[str, Any]
"""Figures of a trial by name, and its specification `spec`."""


@dataclass(frozen=True)
class Campaign(Generic[Spec, AnyTrial]):
    """Trials of one kind."""

    run: Callable[[Spec], AnyTrial]
    """Function of a module that runs a trial; it raises ValueError where there is no such scene."""
    restore: Callable[..., AnyTrial]
    """Function that makes a trial of its fields by name."""
    line: Callable[[AnyTrial], str]
    """Function that states a trial in one line."""

    def trials(
        self,
        specs: Sequence[Spec],
        results: Path | None = None,
        workers: Workers = 1,
        again: bool = False,
    ) -> list[AnyTrial]:
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
        finished: dict[int, AnyTrial | None] = {}
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
                    figures = {"missing": trial} if missing else _fields(trial)
                    _append(results, {"spec": asdict(spec), **figures})
                text = trial if missing else self.line(trial)
                progress.console.print(escape(text))
                progress.advance(bar)
        return [trial for k in range(len(specs)) if (trial := finished[k]) is not None]


@dataclass(frozen=True)
class CampaignOptions(PrintOptions):
    """Options of every campaign: where its trials run, and where they are kept."""

    results: Path | None = None
    """File of finished trials, one JSON object a line; trials that it holds are not run again."""
    workers: Workers = 1
    """Number of processes, or the address of a Dask scheduler."""

    def trials(
        self, run: Callable[[Spec], Trial], specs: Sequence[Spec], again: bool = False
    ) -> list[Trial]:
        """Run trials as these options say; those that there are, in the order of `specs`."""
        campaign = Campaign(partial(_with_spec, run), dict, line_of)
        return campaign.trials(specs, self.results, self.workers, again)


CAMPAIGN_DEFAULTS = CampaignOptions()


def success_interval(successes: int, count: int) -> tuple[float, float]:
    """Return the Wilson interval of a rate of success at 95 % confidence."""
    interval = binomtest(successes, count).proportion_ci(method="wilson")
    return float(interval.low), float(interval.high)


def line_of(trial: Trial) -> str:
    """State a trial in one line: words of its specification, then its figures by name."""
    words = [str(value) for value in asdict(trial["spec"]).values() if not _is_long(value)]
    return f"{', '.join(words)}: {figures_in_words(_fields(trial))}"


def figures_in_words(figures: Mapping[str, Any]) -> str:
    """State the figures of a trial by name, those of lists and tables left out."""
    return ", ".join(
        f"{name} {value:.4g}" if isinstance(value, float) else f"{name} {value}"
        for name, value in figures.items()
        if not _is_long(value)
    )


def _is_long(value: object) -> bool:
    return isinstance(value, list | tuple | dict)


def groups(trials: Sequence[Trial], *names: str) -> dict[tuple[Any, ...], list[Trial]]:
    """Return trials by fields of their specifications, in the order of their appearance."""
    found: dict[tuple[Any, ...], list[Trial]] = {}
    for trial in trials:
        found.setdefault(tuple(getattr(trial["spec"], name) for name in names), []).append(trial)
    return found


def _with_spec(run: Callable[[Spec], Trial], spec: Spec) -> Trial:
    return {"spec": spec, **run(spec)}


def _attempt(run: Callable[[Spec], AnyTrial], spec: Spec) -> AnyTrial | str:
    """Finished trial, or why there is no such scene."""
    try:
        return run(spec)
    except ValueError as missing:
        return str(missing)


def _fields(trial: Any) -> dict[str, Any]:
    """Figures of a trial, without its specification."""
    fields = trial if isinstance(trial, Mapping) else asdict(trial)
    return {name: value for name, value in fields.items() if name != "spec"}


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
