"""Run the sim service alone, live on the bus: `python -m services.sim`."""

from __future__ import annotations

from services.sim.options import SimOptions
from shared.runtime.live import main

if __name__ == "__main__":
    main("services.sim", SimOptions)
