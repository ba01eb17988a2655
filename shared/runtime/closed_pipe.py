"""End of a process whose standard output is a pipe that nobody reads any more, as in `| head`."""

from __future__ import annotations

import os
import select
import sys
from collections.abc import Iterator
from contextlib import contextmanager

EXIT_PIPE_CLOSED = 141
"""Exit status where the reader of standard output has gone: that of a process ended by SIGPIPE."""


@contextmanager
def ending_with_the_reader() -> Iterator[None]:
    """Flush standard output at the end; exit with `EXIT_PIPE_CLOSED` where nobody reads it."""
    try:
        try:
            yield
        finally:
            sys.stdout.flush()
    except BrokenPipeError:
        if not _reader_has_gone():
            raise
        # What is left in the buffer goes nowhere when the interpreter ends.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        raise SystemExit(EXIT_PIPE_CLOSED) from None


def _reader_has_gone() -> bool:
    """Return whether standard output is a pipe whose reader has closed it."""
    poll = select.poll()
    poll.register(sys.stdout, 0)
    return any(events & select.POLLERR for _, events in poll.poll(0))
