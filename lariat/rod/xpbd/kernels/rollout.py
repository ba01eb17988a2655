"""The one kernel of the position-based rod: roll-outs, and their derivatives backwards.

Everything is inlined into it; it compiles in 3 s.
"""

import taichi as ti

from lariat.rod.kernels.types import Doubles, Integers
from lariat.rod.xpbd.kernels.adjoint import predict_adjoint, settle_adjoint, solve_adjoint
from lariat.rod.xpbd.kernels.step import begin, predict, settle, solve
from lariat.rod.xpbd.launch.layout import Header


@ti.kernel
def run(ni: Integers, w: Doubles, batch: ti.i32, forward: ti.i32, backward: ti.i32):
    """Rolls every rod of a batch out, or back along the tape that this left, or both."""
    for b in range(batch):
        rod = b * ni[Header.STRIDE]
        if forward:
            begin(ni, w, rod)
            for step in range(ni[Header.STEPS]):
                predict(ni, w, rod, step, step + 1)
                solve(ni, w, rod, step, step + 1)
                settle(ni, w, rod, step, step + 1)
        if backward:
            for back in range(ni[Header.STEPS]):
                step = ni[Header.STEPS] - 1 - back
                settle_adjoint(ni, w, rod, step)
                solve_adjoint(ni, w, rod, step)
                predict_adjoint(ni, w, rod, step)
