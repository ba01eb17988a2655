"""Independent computations on all cores, or on the workers of a Dask cluster."""

from __future__ import annotations

import multiprocessing
import os
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor, ProcessPoolExecutor, as_completed
from contextlib import contextmanager
from typing import TypeAlias, TypeVar

from lariat.configuration import ConfigurationError
from shared.version import commit, version

Item = TypeVar("Item")
Value = TypeVar("Value")
Workers: TypeAlias = int | str
"""Number of processes, or address of a Dask scheduler, whose workers compute instead."""
CONNECTION_TIMEOUT = 10.0
"""Longest time that a scheduler may take to answer [s]."""


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
