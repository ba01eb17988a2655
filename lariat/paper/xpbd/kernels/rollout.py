"""Kernel of the position-based rod: roll-outs, and their adjoint.

All functions are inlined into it; it compiles in 3 s.
"""

from lariat.kernel_cache.language import ti
from lariat.paper.xpbd.kernels.adjoint import (
    predict_adjoint,
    solve_adjoint,
    update_velocities_adjoint,
)
from lariat.paper.xpbd.kernels.step import predict, solve, start, update_velocities
from lariat.paper.xpbd.launch.layout import Header
from lariat.rod.kernels.types import Doubles, Integers


@ti.kernel
def roll_out(ni: Integers, w: Doubles, batch: ti.i32, forward: ti.i32, backward: ti.i32):
    """Roll out every rod of a batch, or carry derivatives back along its tape, or both."""
    ti.loop_config(serialize=True)
    for b in range(batch):
        rod = b * ni[Header.STRIDE]
        if forward:
            start(ni, w, rod)
            for step in range(ni[Header.STEPS]):
                predict(ni, w, rod, step, step + 1)
                solve(ni, w, rod, step, step + 1)
                update_velocities(ni, w, rod, step, step + 1)
        if backward:
            for back in range(ni[Header.STEPS]):
                step = ni[Header.STEPS] - 1 - back
                update_velocities_adjoint(ni, w, rod, step)
                solve_adjoint(ni, w, rod, step)
                predict_adjoint(ni, w, rod, step)
