"""Campaigns of seeded trials: resumable, on all cores or a Dask cluster, one line per trial.

A specification is a flat frozen dataclass of numbers and words. A trial is a frozen dataclass whose
field `spec` holds it, so that a file of finished trials tells which ones need not be run again.
"""

from __future__ import annotations

import json
import multiprocessing
import os
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor, ProcessPoolExecutor, as_completed
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any, Generic, TypeAlias, TypeVar

from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TimeElapsedColumn
from scipy.stats import binomtest

from lariat.configuration import ConfigurationError
from shared.version import commit, version

Spec = TypeVar("Spec")
Trial = TypeVar("Trial")
Item = TypeVar("Item")
Value = TypeVar("Value")
Workers: TypeAlias = int | str
"""Number of processes, or address of a Dask scheduler, whose workers compute instead."""
CONNECTION_TIMEOUT = 10.0
"""Longest time that a scheduler may take to answer [s]."""


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


def compute(
    function: Callable[[Item], Value], items: Sequence[Item], workers: Workers
) -> Iterator[tuple[int, Value]]:
    """Apply a function to each item; yield index and value in the order in which they finish.

    Processes end with this one, even where it is killed. What a lost worker of a cluster was
    computing is computed anew by another one.

    Args:
        function: Function of a module, which the workers of a cluster have too.
        items: Arguments, which can be pickled.
        workers: Number of processes, or the address of a Dask scheduler.

    Raises:
        ConfigurationError: Dask is missing, no scheduler answers, it has no workers, or a worker
            cannot compute what this process would.
    """
    if not isinstance(workers, str) and workers <= 1:
        yield from ((k, function(item)) for k, item in enumerate(items))
        return
    with _cluster(workers) if isinstance(workers, str) else _processes(workers) as pool:
        futures = {pool.submit(function, item): k for k, item in enumerate(items)}
        for future in as_completed(futures):
            yield futures[future], future.result()


def success_interval(successes: int, count: int) -> tuple[float, float]:
    """Return the Wilson interval of a rate of success at 95 % confidence."""
    interval = binomtest(successes, count).proportion_ci(method="wilson")
    return float(interval.low), float(interval.high)


@contextmanager
def _processes(count: int) -> Iterator[Executor]:
    # Not forked: a copy of a Taichi runtime does not work.
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(count, mp_context=context, initializer=_end_with_parent) as pool:
        try:
            yield pool
        finally:
            pool.shutdown(cancel_futures=True)


@contextmanager
def _cluster(address: str) -> Iterator[Executor]:
    try:
        from distributed import Client
    except ImportError:
        raise ConfigurationError(
            "campaigns on several machines need Dask: pip install -e '.[cluster]'"
        ) from None
    try:
        client = Client(address, timeout=CONNECTION_TIMEOUT)
    except (OSError, ValueError, TypeError) as error:
        raise ConfigurationError(
            f"workers {address!r}: no Dask scheduler answers there ({error}); state a number of "
            "processes, or the address that `dask scheduler` prints"
        ) from error
    with client:
        _check_workers(client.run(_installation), client.nthreads(), address)
        pool = client.get_executor(pure=False)
        try:
            yield pool
        finally:
            pool.shutdown(wait=False)


def _installation() -> tuple[str, str]:
    return version(), commit()


def _check_workers(
    installations: dict[str, tuple[str, str]], threads: dict[str, int], address: str
) -> None:
    """Refuse workers whose results would not be those of this process."""
    if not installations:
        raise ConfigurationError(
            f"workers {address!r}: the scheduler has none; start some with "
            f"`dask worker {address} --nworkers auto --nthreads 1` in their clones"
        )
    for worker, installation in installations.items():
        if installation != _installation():
            raise ConfigurationError(
                f"worker {worker} has Lariat {' '.join(installation)}, this process "
                f"{' '.join(_installation())}; check out the same commit on every machine"
            )
        if threads[worker] != 1:
            raise ConfigurationError(
                f"worker {worker} has {threads[worker]} threads, and a run is the work of a whole "
                "process; start it with `--nworkers auto --nthreads 1`"
            )


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    assert parent is not None
    threading.Thread(target=lambda: (parent.join(), os._exit(1)), daemon=True).start()


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
