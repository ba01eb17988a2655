"""`python -m services.recorder`: this service alone, live on the bus."""

from __future__ import annotations

from services.recorder.options import RecorderOptions
from shared.live import main

if __name__ == "__main__":
    main("services.recorder", RecorderOptions)
