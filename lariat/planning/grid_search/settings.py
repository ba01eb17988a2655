"""Settings of the grid search."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class GridSearchSettings:
    """Resolution and extent of the grid, and the shapes in which the rope is carried."""

    spacing: float = 0.025
    """Distance between grid points for ropes up to `reference_length` [m]; longer ones scale it."""
    reference_length: float = 0.6
    """Length of a rope up to which spacing and extent are as given [m]."""
    extent: float = 0.30
    """Distance around start and goal that is searched, for ropes up to `reference_length` [m]."""
    ceiling_margin: float = 0.05
    """Height above obstacles and grips that is searched, in addition to the sag of the rope [m]."""
    stretches: tuple[float, ...] = (0.93, 0.7, 0.5, 0.35)
    """Grip distances of the carried shapes, relative to the rope's length."""
    min_heading_difference: float = 0.2
    """Angle below which two headings of carried shapes are the same [rad]."""
    max_nodes: int = 24
    """Largest number of nodes of which the clearance is computed."""
