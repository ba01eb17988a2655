"""Run the camera service alone, live on the bus: `python -m services.camera`."""

from __future__ import annotations

from services.camera.options import CameraOptions
from shared.runtime.live import main

if __name__ == "__main__":
    main("services.camera", CameraOptions)
