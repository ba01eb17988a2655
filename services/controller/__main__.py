"""`python -m services.controller`: this service alone, live on the bus."""

from __future__ import annotations

from shared.runtime.live import main

if __name__ == "__main__":
    main("services.controller")
