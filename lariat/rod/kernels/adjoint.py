"""Adjoint of a roll-out, by the implicit function theorem.

Backwards over the solves, with lambda the derivative of the cost with respect to the unknowns,

    H mu = lambda,  lambda_k -= (dg/dx_k)^T mu,  dcost/dtheta -= (dg/dtheta)^T mu.

The factors of every solve are kept. The adjoint of driven blocks goes on to the actions.
"""

from lariat.kernel_cache.language import ti
from lariat.rod.kernels.addressing import (
    hessian_at,
    orientation_at,
    parameter_derivatives_at,
    time_at,
    transposed_at,
)
from lariat.rod.kernels.air_drag import air_drag_adjoint, has_air_drag
from lariat.rod.kernels.friction import friction_adjoint, seed_slips
from lariat.rod.kernels.grip_sensitivities import grip_sensitivities
from lariat.rod.kernels.memory import add, load3, load4, load33
from lariat.rod.kernels.plasticity import plastic_adjoint, seed_sets
from lariat.rod.kernels.rotations import left_jacobian, rotation_matrix
from lariat.rod.kernels.step_terms import internal_rate, step_times, target_share
from lariat.rod.kernels.types import Doubles, Integers, Matrices33
from lariat.rod.launch.codes import EndHold, Task
from lariat.rod.launch.layout import (
    COLUMNS_WIDTH,
    GROUP_COLUMNS,
    HISTORY_SLOTS,
    STEP_BLOCKS,
    Header,
    Section,
    TimeRow,
)


@ti.real_func
def adjoint(
    ni: Integers,
    w: Doubles,
    w33: Matrices33,
    task: ti.i32,
    rod: ti.i32,
    step: ti.i32,
    arg: ti.i32,
    real: ti.f64,
) -> ti.f64:
    """Carry the adjoint over one solve: to the solves before it and to the parameters."""
    result = 0.0
    if task == Task.ADJOINT:
        n = ni[Header.NODES]
        count = 2 * n - 1
        first = ni[Header.FIRST_FREE]
        end = ni[Header.END_FREE]
        _h, weight, carry = step_times(ni, w, rod, step)
        new = rod + ni[Section.ADJOINT] + 3 * count * (step + HISTORY_SLOTS)
        for j in range(ti.max(first - 2, 0), first):
            for k in range(2):
                to = j + 1 + k
                if to >= first and to < end:
                    m = hessian_at(ni, rod, step, j) + 9 + 9 * k
                    add(w, new + 3 * j, -(load33(w, m).transpose() @ load3(w, new + 3 * to)))
        for j in range(ti.max(end - 2, first), end):
            for k in range(2):
                to = j + 1 + k
                if to >= end and to < count:
                    m = transposed_at(ni, rod, step, j) + 9 + 9 * k
                    add(w, new + 3 * to, -(load33(w, m) @ load3(w, new + 3 * j)))
        for j in range(first, end):
            i = j // 2
            v = load3(w, new + 3 * j)
            for back in range(1, ni[Header.HISTORY] + 1):
                old = new - 3 * count * back + 3 * j
                if j % 2 == 0:
                    mass = weight * w[rod + ni[Section.MASSES] + i]
                    add(w, old, (mass * target_share(ni, w, rod, step, back, carry)) * v)
                else:
                    c = rod + ni[Section.INERTIA_COUPLINGS] + 9 * (HISTORY_SLOTS * i + back - 1)
                    add(w, old, -(load33(w, c).transpose() @ v))
        rate = internal_rate(ni, w, rod, step)
        if rate > 0.0:
            for i in range(n - 2):
                j = 2 * i + 1
                after = rod + ni[Section.BEND_JACOBIANS] + 27 * i
                jacobian = load33(w, after)
                moment = ti.Vector([0.0, 0.0, 0.0])
                if j >= first:
                    moment -= jacobian @ load3(w, new + 3 * j)
                if j + 2 < end:
                    moment += jacobian.transpose() @ load3(w, new + 3 * j + 6)
                moment *= rate * load3(w, rod + ni[Section.BENDS] + 6 * i)
                for back in range(1, 3):
                    share = w[time_at(ni, rod, step) + TimeRow.BASE_SHARES + back - 1]
                    old = new - 3 * count * back + 3 * j
                    jacobian = share * load33(w, after + 9 * back)
                    add(w, old, -(jacobian.transpose() @ moment))
                    add(w, old + 6, jacobian @ moment)
        if has_air_drag(ni, w, rod):
            air_drag_adjoint(ni, w, rod, step)
        if ni[Header.FRICTION_PAIRS] > 0:
            friction_adjoint(ni, w, rod, step)
        if ni[Header.LAYERS] > 0:
            plastic_adjoint(ni, w, rod, step)
        for p in range(ni[Header.PARAMETERS]):
            force = parameter_derivatives_at(ni, rod, p // GROUP_COLUMNS, 0)
            force += p % GROUP_COLUMNS
            total = 0.0
            for j in range(first, end):
                for a in ti.static(range(3)):
                    total -= w[new + 3 * j + a] * w[force + COLUMNS_WIDTH * j + GROUP_COLUMNS * a]
            to = rod + ni[Section.PARAMETERS_OUT] + p
            w[to] = w[to] + total
    elif task == Task.SEED_STATE:
        if ni[Header.FRICTION_PAIRS] > 0:
            seed_slips(ni, w, rod, step)
        if ni[Header.LAYERS] > 0:
            seed_sets(ni, w, rod, step)
    else:
        result = grip_adjoint(ni, w, w33, task, rod, step, arg, real)
    return result


@ti.real_func
def grip_adjoint(
    ni: Integers,
    w: Doubles,
    w33: Matrices33,
    task: ti.i32,
    rod: ti.i32,
    step: ti.i32,
    arg: ti.i32,
    real: ti.f64,
) -> ti.f64:
    """Carry the adjoint at driven blocks on to the actions and to the solve before."""
    result = 0.0
    if task == Task.GRIP_ADJOINT:
        n = ni[Header.NODES]
        new = rod + ni[Section.ADJOINT] + 3 * (2 * n - 1) * (step + HISTORY_SLOTS)
        start = time_at(ni, rod, step)
        old = new - 3 * (2 * n - 1) * ti.cast(w[start + TimeRow.GRIP_SOLVES_BACK], ti.i32)
        h = w[start + TimeRow.GRIP_DURATION]
        block = ni[STEP_BLOCKS + step // ni[Header.SUBSTEPS]]
        for end in range(2):
            kind = ni[Header.LEFT_END + end]
            action = rod + ni[Section.ACTIONS] + 12 * block + 6 * end
            out = rod + ni[Section.ACTIONS_OUT] + 12 * block + 6 * end
            if kind != EndHold.FREE:
                outer = 6 * end * (n - 1)
                pull = load3(w, new + outer)
                if kind == EndHold.CLAMPED:
                    edge = end * (n - 2)
                    pull += load3(w, new + 6 * (1 + end * (n - 3)))
                    r = rotation_matrix(
                        load4(w, orientation_at(ni, rod, step + HISTORY_SLOTS, edge))
                    )
                    moment = load3(w, new + 6 * edge + 3)
                    jacobian = left_jacobian(h * load3(w, action + 3))
                    add(w, out + 3, h * (jacobian.transpose() @ (r @ moment)))
                    add(w, old + 6 * edge + 3, moment)
                add(w, out, h * pull)
                add(w, old + outer, pull)
    else:
        result = grip_sensitivities(ni, w, w33, task, rod, step, arg, real)
    return result
