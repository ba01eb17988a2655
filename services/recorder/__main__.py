"""Run the recorder alone, live on the bus: `python -m services.recorder`."""

from __future__ import annotations

from services.recorder.options import RecorderOptions
from shared.runtime.live import main

if __name__ == "__main__":
    main("services.recorder", RecorderOptions)
