"""Run the dashboard alone, live on the bus: `python -m dashboard`."""

from __future__ import annotations

from dashboard.options import DashboardOptions
from shared.live import main

if __name__ == "__main__":
    main("dashboard", DashboardOptions)
