"""Reservation of memory, so that no step of a service waits for new pages."""

from __future__ import annotations

import ctypes
import sys

import numpy as np

RESERVED_SIZE = 32 << 20
"""Memory that a step may allocate beyond all earlier steps without new pages [bytes]."""
_M_TRIM_THRESHOLD, _M_MMAP_MAX = -1, -4
"""Parameters of mallopt(3)."""


def reserve_memory() -> None:
    """Make the C library keep freed memory, and a reserve whose pages have been touched.

    The first access to a page takes microseconds, and far more on a machine that has been idle. A
    step that needs thousands of new pages would be late. Does nothing without glibc on Linux.
    """
    if not sys.platform.startswith("linux"):
        return
    try:
        mallopt = ctypes.CDLL(None).mallopt
    except AttributeError:
        # The C library is not glibc.
        return
    mallopt(_M_TRIM_THRESHOLD, 2**31 - 1)
    mallopt(_M_MMAP_MAX, 0)
    np.ones(RESERVED_SIZE // 8)
