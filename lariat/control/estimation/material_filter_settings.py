"""Periods, noise and thresholds of the filter of the rope's material."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class MaterialFilterSettings:
    """Periods, noise and thresholds of the filter."""

    update_period: int = 400_000_000
    """Time between updates while the rope moves [ns].

    The model needs time to take its new shape; at rest it takes it at once.
    """
    update_period_at_rest: int = 100_000_000
    """Time between updates while the rope rests [ns]."""
    memory_time: float = 60.0
    """Time constant with which evidence decays [s]: a rope can be exchanged by hand."""
    model_error: float = 3e-4
    """Error of rod and sensor, alike in neighbouring nodes and while nothing moves [m]."""
    error_scale_weight: float = 20.0
    """Observed components that outweigh the assumed size of all errors."""
    leaning_error: float = 2e-3
    """The same of a rope that leans on a support, whose friction the model does not know [m]."""
    independent_shape_distance: float = 0.04
    """Displacement of a grip after which the model error is independent [m]."""
    same_shape_distance: float = 0.01
    """Displacement of a grip below which observations belong to one shape [m]."""
    standing_distance: float = 5e-4
    """Displacement of a grip below which it stands still [m]."""
    rest_speed: float = 0.02
    """Mean speed of the model's nodes below which it rests [m/s]."""
    swinging_error_time: float = 0.05
    """Error of the model per node speed, because the Jacobian is that of a rope at rest [s]."""
    outlier_deviations: float = 3.0
    """Innovation of a node, in standard deviations, above which it is an outlier, and standard
    deviation of an outlier relative to its excess [-]."""
    new_evidence_share: float = 0.6
    """Share of the evidence of a shape that is kept when the grips leave it [-]: the error of a
    coarse rod repeats itself from shape to shape."""
    standing_spread: float = 0.01
    """Standard deviation of the stiffness that fits one shape at rest from the rope's, as a
    logarithm [-].

    Near a fold a rope tells its stiffness sharply, but the rod is not that good a model.
    """
    moving_spread: float = 0.05
    """The same of a rope that moves, which has not yet taken its shape at rest [-]."""
    max_log_stiffness_step: float = math.log(2.0)
    """Largest change of the stiffness's logarithm in one update [-]."""
    min_shape_change: float = 2e-4
    """Change of the rest shape below which the model keeps its properties [m]."""
    settled_shape_change: float = 1e-3
    """Change of the rest shape in one update below which the material has settled [m]."""
    converged_shape_change: float = 1e-4
    """Change of the rest shape in one update below which a shape that has been observed for long
    tells no more [m]."""
    max_misfit_growth: float = 1e-3
    """Growth of the distance between rope and model's rest shape above which a step is shortened
    [m]."""
    known_share: float = 0.5
    """Share of its prior standard deviation below which an unknown counts as known [-]."""
