"""What libraries print on standard error, read instead of shown."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager

STANDARD_ERROR = 2
"""File descriptor to which libraries print."""


@contextmanager
def kept_prints() -> Iterator[list[str]]:
    """Keep the lines that are printed meanwhile; the list has them when the block ends.

    It redirects the standard error of the whole process: for a moment, not in a service's loop.
    """
    lines: list[str] = []
    shown = os.dup(STANDARD_ERROR)
    try:
        with tempfile.TemporaryFile() as printed:
            os.dup2(printed.fileno(), STANDARD_ERROR)
            try:
                yield lines
            finally:
                os.dup2(shown, STANDARD_ERROR)
                printed.seek(0)
                lines += printed.read().decode(errors="replace").splitlines()
    finally:
        os.close(shown)
