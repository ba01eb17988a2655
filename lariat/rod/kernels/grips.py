"""Driven ends: their place after a solve, and their effect on the free unknowns.

A grip that moves with velocity v and angular velocity omega for a time h goes from (p, R) to
(p + h v, exp(h omega) R). A pinned end has its outermost node at p. A clamp has both nodes of its
grip edge at p, and the frame of that edge is R. The driven blocks d of the unknowns take no part in
the linear solve for the free blocks f:

    H_ff s_f = -g_f - H_fd s_d.
"""

from lariat.kernel_cache.language import ti
from lariat.rod.kernels.addressing import (
    hessian_at,
    orientation_at,
    position_at,
    transposed_at,
)
from lariat.rod.kernels.memory import add, load3, load4, load33, store
from lariat.rod.kernels.rotations import logarithm, relative_rotation
from lariat.rod.kernels.sensitivities import sensitivities
from lariat.rod.kernels.step_terms import grip_target
from lariat.rod.kernels.types import Doubles, Integers, Matrices33
from lariat.rod.launch.codes import EndHold, Task
from lariat.rod.launch.layout import HISTORY_SLOTS, Header, Section


@ti.real_func
def move_grips(
    ni: Integers,
    w: Doubles,
    w33: Matrices33,
    task: ti.i32,
    rod: ti.i32,
    step: ti.i32,
    arg: ti.i32,
    real: ti.f64,
) -> ti.f64:
    """Place the driven blocks at their grips (`arg` 1), or write their step to there."""
    result = 0.0
    if task == Task.MOVE_GRIPS:
        exactly = arg
        n = ni[Header.NODES]
        d = rod + ni[Section.NEWTON_STEP]
        for end in range(2):
            kind = ni[Header.LEFT_END + end]
            if kind != EndHold.FREE:
                position, q = grip_target(ni, w, rod, step, end)
                node = end * (n - 1)
                if exactly:
                    store(w, position_at(ni, rod, step + HISTORY_SLOTS, node), position)
                else:
                    x = load3(w, position_at(ni, rod, step + HISTORY_SLOTS, node))
                    store(w, d + 6 * node, position - x)
                if kind == EndHold.CLAMPED:
                    node = 1 + end * (n - 3)
                    edge = end * (n - 2)
                    if exactly:
                        store(w, position_at(ni, rod, step + HISTORY_SLOTS, node), position)
                        store(w, orientation_at(ni, rod, step + HISTORY_SLOTS, edge), q)
                    else:
                        x = load3(w, position_at(ni, rod, step + HISTORY_SLOTS, node))
                        before = load4(w, orientation_at(ni, rod, step + HISTORY_SLOTS, edge))
                        store(w, d + 6 * node, position - x)
                        store(w, d + 6 * edge + 3, logarithm(relative_rotation(before, q)))
    else:
        result = sensitivities(ni, w, w33, task, rod, step, arg, real)
    return result


@ti.real_func
def subtract_couplings(
    ni: Integers,
    w: Doubles,
    w33: Matrices33,
    task: ti.i32,
    rod: ti.i32,
    step: ti.i32,
    arg: ti.i32,
    real: ti.f64,
) -> ti.f64:
    """Subtract the effect of driven blocks from the free blocks of the vector at `arg`."""
    result = 0.0
    if task == Task.SUBTRACT_COUPLINGS:
        d = arg
        first = ni[Header.FIRST_FREE]
        end = ni[Header.END_FREE]
        count = 2 * ni[Header.NODES] - 1
        for j in range(ti.max(first - 2, 0), first):
            v = load3(w, d + 3 * j)
            for k in range(2):
                to = j + 1 + k
                if to >= first and to < end:
                    m = hessian_at(ni, rod, step, j) + 9 + 9 * k
                    add(w, d + 3 * to, -(load33(w, m) @ v))
        for j in range(ti.max(end - 2, first), end):
            for k in range(2):
                to = j + 1 + k
                if to >= end and to < count:
                    m = transposed_at(ni, rod, step, j) + 9 + 9 * k
                    add(w, d + 3 * j, -(load33(w, m).transpose() @ load3(w, d + 3 * to)))
    else:
        result = move_grips(ni, w, w33, task, rod, step, arg, real)
    return result
