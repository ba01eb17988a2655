"""What libraries are told before they load."""

from __future__ import annotations

LIBRARY_SETTINGS = {
    # Two cores carry the whole stack: a library that starts a thread a core only makes others late.
    "OMP_NUM_THREADS": "1",
    "OPENBLAS_NUM_THREADS": "1",
    "MKL_NUM_THREADS": "1",
    # Taichi greets on standard output, where --json promises one object and nothing else.
    "ENABLE_TAICHI_HEADER_PRINT": "0",
}
"""Environment variables."""
