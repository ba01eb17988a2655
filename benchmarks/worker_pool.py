"""Independent computations in one or several processes, or on several machines."""

from __future__ import annotations

import multiprocessing
import os
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from typing import TypeAlias, TypeVar

from benchmarks import cluster

Workers: TypeAlias = int | str
"""Number of processes, or address of a Dask scheduler, whose workers compute instead."""
Item = TypeVar("Item")
Result = TypeVar("Result")


def compute(
    function: Callable[[Item], Result], items: Sequence[Item], workers: Workers
) -> Iterator[tuple[int, Result]]:
    """Apply a function to each item; yield index and result in the order in which they finish.

    The processes end with this one, even where it is killed.

    Raises:
        ConfigurationError: A cluster cannot be used.
    """
    if isinstance(workers, str):
        yield from cluster.compute(function, items, workers)
        return
    if workers <= 1:
        yield from ((k, function(item)) for k, item in enumerate(items))
        return
    # Not forked: a copy of a Taichi runtime does not work.
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(workers, mp_context=context, initializer=_end_with_parent) as pool:
        futures = {pool.submit(function, item): k for k, item in enumerate(items)}
        try:
            for future in as_completed(futures):
                yield futures[future], future.result()
        finally:
            pool.shutdown(cancel_futures=True)


def _end_with_parent() -> None:
    threading.Thread(target=_wait_for_parent, daemon=True).start()


def _wait_for_parent() -> None:
    parent = multiprocessing.parent_process()
    assert parent is not None
    parent.join()
    os._exit(1)
