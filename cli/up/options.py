"""Options of `lariat up`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from services.recorder.options import RecorderOptions
from shared.ros2.router import DEFAULT_ROUTER


@dataclass(frozen=True)
class UpOptions:
    """Live stack to start."""

    scenario: Annotated[Path, tyro.conf.Positional] = Path("three-cylinders")
    """A scenario's TOML file, or the short name of a shipped one."""
    port: int = 7448
    """Port of the bus' hub on 127.0.0.1."""
    dashboard_port: int = 8080
    """Port of the dashboard's page on 127.0.0.1."""
    namespace: str = "cell"
    """Name of the cell on the bus."""
    dashboard: bool = True
    """Whether to serve the dashboard."""
    dashboard_address: tuple[str, ...] = ()
    """Further addresses of the page, e.g. of a TLS proxy, https://lab.example."""
    dashboard_password_file: Path | None = None
    """File with the password for addresses that other machines reach."""
    browser: bool = False
    """Whether to open the page in a browser."""
    record: bool = True
    """Whether to record every run to recordings/."""
    record_always: bool = False
    """Whether the idle cell is recorded like a run, with its images."""
    keep: float | None = RecorderOptions.keep
    """Size of all recordings beyond which the oldest are deleted, those of idle cells first [GB];
    by default none is. The log names a file before it is deleted; runs with a star stay."""
    ros2: bool = False
    """Whether to join ROS 2's graph (rmw_zenoh) as a node that shows the cell; `lariat ros2` lists
    its topics."""
    ros2_commands: bool = False
    """Whether ROS 2 nodes may set goals and obstacles, move joints, start, pause, stop, reset and
    hold."""
    ros2_router: str = DEFAULT_ROUTER
    """Zenoh endpoint of ROS 2's router; where none answers, the node serves one there."""
    saved_scenarios: Path = Path("my-scenarios")
    """Folder of the scenarios that people save on the page."""
