"""Controller of one's own: proportional control of the shape."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float64

from lariat.protocols import ControllerInput, ControllerSetup
from lariat.rod import RolloutSpec

HORIZON = 0.4
"""Time over which the effect of a velocity is predicted [s]."""
GAIN = 2.0
"""Share of the error that is removed per second [1/s]."""
DAMPING = 1e-5
"""Number added to the normal equations, relative to their mean diagonal [-]."""


class ShapeServo:
    """Proportional control through the rod's Jacobian, by damped least squares."""

    def __init__(self, setup: ControllerSetup) -> None:
        self.moves = setup.moves
        self.speed = 0.5 * setup.limits.speed

    def reset(self) -> None:
        """Forget the run before; this controller has no memory."""

    def velocity(self, state: ControllerInput) -> Float64[np.ndarray, "2 6"]:
        """Return the velocities of both grips: linear [m/s], then angular [rad/s]."""
        spec = RolloutSpec(state.state, np.zeros((1, 2, 6)), HORIZON / 16, steps=16)
        jacobian = state.rod.linearize(spec).d_positions_d_actions[-1, :, :, 0]
        jacobian = jacobian[..., self.moves].reshape(state.nodes.size, -1)
        normal = jacobian.T @ jacobian
        normal += DAMPING * np.trace(normal) / len(normal) * np.eye(len(normal))
        correction = GAIN * HORIZON * (state.goal - state.nodes).ravel()
        answer = np.zeros((2, 6))
        answer[self.moves] = np.linalg.solve(normal, jacobian.T @ correction)
        fastest = np.max(np.linalg.norm(answer[:, :3], axis=1))
        return answer * min(1.0, self.speed / max(fastest, 1e-9))
