"""`python -m services.planner`: run the planner service live on the bus."""

from __future__ import annotations

from shared.runtime.live import main

if __name__ == "__main__":
    main("services.planner")
