"""Environment variables that libraries read when they load."""

from __future__ import annotations

LIBRARY_ENVIRONMENT = {
    # The whole stack shares few cores: a thread per core in each library only delays the others.
    "OMP_NUM_THREADS": "1",
    "OPENBLAS_NUM_THREADS": "1",
    "MKL_NUM_THREADS": "1",
    # MuJoCo's renderer, which nothing uses, takes half of its import to ask for OpenGL.
    "MUJOCO_GL": "disable",
    # Taichi greets on standard output, which belongs to the answer of --json alone.
    "ENABLE_TAICHI_HEADER_PRINT": "0",
}
