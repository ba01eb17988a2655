"""Place in ROS 2's graph: the address of its router, and its domain."""

from __future__ import annotations

import os

DEFAULT_ROUTER = "tcp/127.0.0.1:7447"
"""Endpoint of ROS 2's router by default."""


def environment_domain() -> int:
    """Return the domain of the environment, ROS_DOMAIN_ID; 0 without one."""
    text = os.environ.get("ROS_DOMAIN_ID", "")
    return int(text) if text.isdecimal() else 0
