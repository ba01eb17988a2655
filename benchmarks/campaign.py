"""Campaigns of seeded trials: resumable, on all cores or a Dask cluster, one line per trial.

A specification is a flat frozen dataclass of numbers and words. A trial is a dictionary of figures
with its specification as `spec`, so that a file of finished trials tells which ones need not be run
again.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any, TypeAlias, TypeVar

from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TimeElapsedColumn
from scipy.stats import binomtest

from benchmarks.tables import PrintOptions
from lariat.configuration import ConfigurationError
from stack.workers import Workers, compute

Spec = TypeVar("Spec")
Trial: TypeAlias = dict[str, Any]
"""Figures of a trial by name, and its specification `spec`."""


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
        """Run trials, print a line for each, and return them in the order of their specifications.

        A trial whose function raises ValueError has no such scene, and is left out.
        """
        finished: dict[int, Trial] = {}
        for k, row in enumerate(_read(self.results, specs) if self.results and not again else ()):
            if row is not None:
                finished[k] = {**row, "spec": specs[k]}
        open_ones = [k for k in range(len(specs)) if k not in finished]
        attempts = compute(partial(_attempt, run), [specs[k] for k in open_ones], self.workers)
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
            for index, figures in attempts:
                spec: Any = specs[open_ones[index]]
                finished[open_ones[index]] = trial = {"spec": spec, **figures}
                if self.results:
                    _append(self.results, {**trial, "spec": asdict(spec)})
                progress.console.print(escape(trial.get("missing") or line_of(trial)))
                progress.advance(bar)
        return [finished[k] for k in range(len(specs)) if "missing" not in finished[k]]


CAMPAIGN_DEFAULTS = CampaignOptions()


def success_interval(successes: int, count: int) -> tuple[float, float]:
    """Return the Wilson interval of a rate of success at 95 % confidence."""
    interval = binomtest(successes, count).proportion_ci(method="wilson")
    return float(interval.low), float(interval.high)


def line_of(trial: Trial) -> str:
    """State a trial in one line: words of its specification, then its figures by name."""
    words = [str(value) for value in asdict(trial["spec"]).values() if not _is_long(value)]
    figures = {name: value for name, value in trial.items() if name != "spec"}
    return f"{', '.join(words)}: {figures_in_words(figures)}"


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


def _attempt(run: Callable[[Spec], Trial], spec: Spec) -> Trial:
    """Figures of a trial, or why there is no such scene, as `missing`."""
    try:
        return run(spec)
    except ValueError as missing:
        return {"missing": str(missing)}


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
