"""`python -m services.camera`: a real RGB-D camera, or a recorded one, on the bus."""

from __future__ import annotations

from services.camera.options import CameraOptions
from shared.live import main

if __name__ == "__main__":
    main("services.camera", CameraOptions)
