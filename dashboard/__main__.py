"""Run the dashboard alone, live on the bus: `python -m dashboard`."""

from __future__ import annotations

import os

from dashboard.options import DashboardOptions
from shared.live import main

RECEIVING_THREADS = "(rx: (worker_threads: 1))"
"""Threads in which Zenoh receives, in its own notation: of two, each message wakes both."""

if __name__ == "__main__":
    # Read when the bus is opened; a person's own setting stays.
    os.environ.setdefault("ZENOH_RUNTIME", RECEIVING_THREADS)
    main("dashboard", DashboardOptions)
