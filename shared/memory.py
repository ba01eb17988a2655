"""Memory that is there before it is needed."""

from __future__ import annotations

import ctypes
import sys

import numpy as np

RESERVE = 32 << 20
"""What a step may ask for beyond what it has asked for before [B]."""
_TRIM_THRESHOLD, _MMAP_MAX = -1, -4


def reserve() -> None:
    """Has the C library keep what is freed, and a reserve that has been touched.

    A page that is touched for the first time costs microseconds, on a machine that has been idle
    far more: a first step that asks for thousands of them would come too late.
    """
    if not sys.platform.startswith("linux"):
        return
    try:
        mallopt = ctypes.CDLL(None).mallopt
    except AttributeError:
        # Another C library than glibc.
        return
    mallopt(_TRIM_THRESHOLD, 2**31 - 1)
    mallopt(_MMAP_MAX, 0)
    np.ones(RESERVE // 8)
