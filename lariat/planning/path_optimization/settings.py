"""Settings of the path optimisation."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace


@dataclass(frozen=True)
class PathOptimizationSettings:
    """Discretisation, weights and margins of the path optimisation.

    Weights multiply residuals in millimetres; a rotation counts as the arc on a circle whose
    circumference is the rope's length.
    """

    blocks: int = 12
    """Number of blocks, in each of which both grips move by a constant displacement."""
    steps_per_block: int = 3
    """Number of implicit steps of the rod in a block."""
    settling_steps: int = 2
    """Number of steps without motion at the end."""
    step_time: float = 0.4
    """Duration of a step [s], long against the swing's period, so that the rod follows at rest."""
    smoothness_weight: float = 0.02
    """Weight of the change of displacement from block to block."""
    effort_weight: float = 0.01
    """Weight of the displacements."""
    clearance_weight: float = 0.5
    """Weight of missing clearance."""
    support_weight: float = 0.2
    """Weight of missing clearance to supports, except where start and goal lean on them: the rope
    approaches its support from above, instead of being dragged along it against friction."""
    grip_distance_weight: float = 3.0
    """Weight of a distance of the grips, or of the grippers, outside its limits."""
    end_relaxation: float = 5e-4
    """Clearance by which the path may fall short of that of start and goal [m]."""
    end_blocks: int = 2
    """Number of blocks at both ends in which the clearance of start or goal is sufficient."""
    clearance_gain: float = 0.008
    """Increase of the required clearance with each further block from the ends [m]."""
    clearance_reserve: float = 0.004
    """Clearance beyond the wanted one [m], for deviations in motion from the quasi-static path."""
    uncertainty_deviations: float = 2.0
    """Standard deviations of a node's position that are added to its clearance [-]."""
    max_uncertainty: float = 0.02
    """Largest clearance that is added for them [m]."""
    initial_damping: float = 1e-3
    """Levenberg-Marquardt damping of the first iteration."""
    damping_range: tuple[float, float] = (1e-7, 1e6)
    """Range of the damping."""
    damping_increase: float = 10.0
    """Factor on the damping after a step that does not lower the cost."""
    damping_decrease: float = 0.2
    """Factor on the damping after a step that lowers the cost."""
    max_damping_increases: int = 8
    """Number of steps in a row that may fail before the path counts as optimal."""
    relative_tolerance: float = 1e-3
    """Relative gain of an iteration below which the optimisation has converged."""
    absolute_tolerance: float = 1e-4
    """Absolute gain that is added to the relative one [mm^2]."""
    block_length: float = 0.08
    """Motion of a grip above which a path has more blocks, one for each such length [m]."""
    max_blocks: int = 32
    """Largest number of blocks."""

    def for_length(self, length: float) -> PathOptimizationSettings:
        """Return the settings with as many blocks as a path needs.

        Args:
            length: Motion of the grip that moves further, rotation included [m].
        """
        needed = math.ceil(length / self.block_length)
        return replace(self, blocks=min(max(self.blocks, needed), self.max_blocks))
