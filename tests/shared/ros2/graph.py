"""Graph of nodes for a test, with a router of its own."""

from __future__ import annotations

from contextlib import ExitStack

from shared.ros2.node import Node
from shared.runtime.free_port import free_port


class Graph:
    """Nodes of one graph; the first one serves the router."""

    def __init__(self, stack: ExitStack) -> None:
        self.router = f"tcp/127.0.0.1:{free_port()}"
        self._stack = stack
        self.first = self.node("first")

    def node(self, name: str, namespace: str = "") -> Node:
        """A node that has joined."""
        node = Node(name, namespace, router=self.router)
        self._stack.callback(node.close)
        return node
