"""Options of the sim process, apart from the service so that `--help` needs no simulator."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class SimOptions:
    """Options of the sim process in addition to those of every service."""

    real_time: bool = True
    """Whether a rope whose `plant.rope.node_count` is not given gets only as many nodes as can be
    simulated in real time."""
