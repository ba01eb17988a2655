"""The one kernel of the implicit rod: roll-outs, their derivatives, and statics as a roll-out.

Everything is inlined once, sizes are arguments, and a launch does a whole horizon, since a launch
costs as much as a step.
"""

import taichi as ti

from shared.rod import layout as at
from shared.rod.kernels_derivatives import (
    adjoint_step,
    couple_inertia,
    parameter_forces,
    sensitivities,
)
from shared.rod.kernels_ends import begin, finish
from shared.rod.kernels_newton import descend
from shared.rod.kernels_types import Doubles, Integers


@ti.kernel
def roll(
    ni: Integers,
    w: Doubles,
    batch: ti.i32,
):
    """Roll every rod of a batch out; see `layout` for what the arrays hold."""
    for b in range(batch):
        rod = b * ni[at.STRIDE]
        want = ni[at.WANT]
        begin(ni, w, rod)
        for step in range(ni[at.STEPS]):
            descend(ni, w, rod, step)
            if want > 0:
                couple_inertia(ni, w, rod, step)
                parameter_forces(ni, w, rod, step)
            if want & at.WANT_SENSITIVITIES:
                sensitivities(ni, w, rod, step)
        finish(ni, w, rod)
        if want & at.WANT_ADJOINT:
            for back in range(ni[at.STEPS]):
                adjoint_step(ni, w, rod, ni[at.STEPS] - 1 - back)
