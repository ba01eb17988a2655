"""Environment variables that libraries read when they load."""

from __future__ import annotations

LIBRARY_ENVIRONMENT = {
    # The whole stack shares few cores: a thread per core in each library only delays the others.
    "OMP_NUM_THREADS": "1",
    "OPENBLAS_NUM_THREADS": "1",
    "MKL_NUM_THREADS": "1",
    # OpenCV's threads wait for work in a loop that takes as long as the work.
    "OPENCV_FOR_THREADS_NUM": "1",
    # One thread of Zenoh receives, on the sockets that it waits for itself; another one sends.
    "ZENOH_RUNTIME": "(rx: (worker_threads: 1), acc: (handover: rx), net: (handover: rx))",
    # MuJoCo's renderer, which nothing uses, takes half of its import to ask for OpenGL.
    "MUJOCO_GL": "disable",
    # Taichi and Quadrants greet on standard output, which belongs to the answer of --json alone.
    "ENABLE_TAICHI_HEADER_PRINT": "0",
    "ENABLE_QUADRANTS_HEADER_PRINT": "0",
}
