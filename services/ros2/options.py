"""Command-line options of the ROS 2 node, beside those of every service."""

from __future__ import annotations

from dataclasses import dataclass, field

from shared.ros2.router import DEFAULT_ROUTER, environment_domain


@dataclass(frozen=True)
class Ros2Options:
    """Place of the node in the graph, and what it may do."""

    router: str = DEFAULT_ROUTER
    """Zenoh endpoint of ROS 2's router; where none answers, the node serves one there."""
    domain: int = field(default_factory=environment_domain)
    """Domain of the graph; by default ROS_DOMAIN_ID."""
    commands: bool = False
    """Whether ROS 2 nodes may set goals and obstacles, move joints, start, pause, stop, reset and
    hold; arms are armed and resumed by a person at page or terminal in any case."""
