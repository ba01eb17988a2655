"""Address of ROS 2's router."""

DEFAULT_ROUTER = "tcp/127.0.0.1:7447"
"""Endpoint of ROS 2's router by default."""
