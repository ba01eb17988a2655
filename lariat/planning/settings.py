"""Settings of the planner of whole paths."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class PlannerSettings:
    """Effort of the planner."""

    iterations: int = 12
    """Largest number of Gauss-Newton iterations of a candidate."""
    wider_iterations: int = 5
    """Largest number of further iterations with a larger reserve."""
    reserve_per_shortfall: float = 1.3
    """Reserve that is added per clearance lost in motion [-]."""
    max_refined: int = 3
    """Largest number of candidates that are refined."""
    min_difference: float = 0.04
    """Distance of the grips halfway above which two candidates are different paths [m]."""
    max_seed_shortfall: float = 0.01
    """Shortfall of the best seed above which the trees are tried before a seed is refined [m]."""
    tree_clearances: tuple[float, ...] = (0.8, 0.5, 0.65)
    """Clearances of the tree searches in the order of trial: the first one relative to the wanted
    clearance, the others to the necessary one."""
    tree_iterations: int = 3
    """Largest number of Gauss-Newton iterations of a path that the trees found."""
    tree_growth: tuple[int, ...] = (10, 150)
    """Numbers of iterations after which the searches take turns: after few, they have tried to lead
    the rope lengthwise through each narrow passage."""
    max_rest_error: float = 0.02
    """Mean node distance of the goal from a rest shape between its grips above which the trees are
    not tried, because the goal is not a shape that the rope takes [m]."""
    max_parts: int = 8
    """Largest number of parts of blocked paths that are timed."""


PLANNER_SETTINGS = PlannerSettings()
"""Default settings of the planner."""
