"""Run the ROS 2 node alone, live on the bus: `python -m services.ros2`."""

from __future__ import annotations

from services.ros2.options import Ros2Options
from shared.runtime.live import main

if __name__ == "__main__":
    main("services.ros2", Ros2Options)
