"""Independent computations on the workers of a Dask cluster, on one or several machines."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import TypeVar

from lariat.configuration import ConfigurationError
from shared.version import commit, version

Item = TypeVar("Item")
Result = TypeVar("Result")

CONNECTION_TIMEOUT = 10.0
"""Longest time that the scheduler may take to answer [s]."""


def compute(
    function: Callable[[Item], Result], items: Sequence[Item], address: str
) -> Iterator[tuple[int, Result]]:
    """Apply a function to each item; yield index and result in the order in which they finish.

    What a lost worker was computing is computed anew by another one.

    Args:
        function: Function of a module of this clone, which the workers have too.
        items: Arguments, which can be pickled.
        address: Address of the scheduler, such as `tcp://lab-1:8786`.

    Raises:
        ConfigurationError: Dask is missing, no scheduler answers, it has no workers, or a worker
            cannot compute what this process would.
    """
    try:
        from distributed import Client, as_completed
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
        futures = client.map(function, items, pure=False)
        index = {future.key: k for k, future in enumerate(futures)}
        for future in as_completed(futures):
            yield index[future.key], future.result()


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
