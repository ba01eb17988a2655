"""Run the dashboard alone, live on the bus: `python -m dashboard`."""

from __future__ import annotations

import os

from dashboard.options import DashboardOptions
from shared.runtime.live import main

RECEIVING_THREAD = "(rx: (handover: net))"
"""Thread in which Zenoh receives, in its own notation: that which reads the network. By default
there are two more, and each message wakes them."""

if __name__ == "__main__":
    # Read when the bus is opened; a person's own setting stays.
    os.environ.setdefault("ZENOH_RUNTIME", RECEIVING_THREAD)
    main("dashboard", DashboardOptions)
