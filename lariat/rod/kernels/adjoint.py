"""The adjoint."""

import taichi as ti

from lariat.rod.kernels.access import (
    hessian_at,
    internal_rate,
    orientation_at,
    scalar,
    step_times,
    target_share,
    time_at,
)
from lariat.rod.kernels.rotations import add3, left_jacobian, load3, load4, load33, rotation_matrix
from lariat.rod.kernels.step_derivatives import (
    parameter_code_at,
    parameter_forces,
    parameter_forces_at,
)
from lariat.rod.kernels.types import Doubles, Integers
from lariat.rod.launch import layout as at


@ti.real_func
def grip_adjoint(
    ni: Integers, w: Doubles, task: ti.i32, rod: ti.i32, step: ti.i32, arg: ti.i32, real: ti.f64
) -> ti.f64:
    """Fold the slopes at driven blocks into the actions and the step before."""
    result = 0.0
    if task == at.GRIP_ADJOINT:
        n = ni[at.NODES]
        new = rod + ni[at.AT_ADJOINT] + 3 * (2 * n - 1) * (step + at.NEW)
        start = time_at(ni, rod, step)
        old = new - 3 * (2 * n - 1) * ti.cast(w[start + at.GRIP_BACK], ti.i32)
        h = w[start + at.GRIP_DURATION]
        block = ni[at.INTEGERS + step // ni[at.SUBSTEPS]]
        for end in range(2):
            kind = ni[at.LEFT + end]
            action = rod + ni[at.AT_ACTIONS] + 12 * block + 6 * end
            out = rod + ni[at.AT_ACTIONS_OUT] + 12 * block + 6 * end
            if kind != at.FREE:
                outer = 6 * end * (n - 1)
                pull = load3(w, new + outer)
                if kind == at.CLAMPED:
                    edge = end * (n - 2)
                    inner = load3(w, new + 6 * (1 + end * (n - 3)))
                    pull += inner
                    r = rotation_matrix(load4(w, orientation_at(ni, rod, step + at.NEW, edge)))
                    reach = scalar(ni, w, rod, at.EDGE_LENGTH) * (1.0 - 2.0 * end)
                    local = reach * (r.transpose() @ inner)
                    moment = load3(w, new + 6 * edge + 3) + ti.Vector([-local[1], local[0], 0.0])
                    turn = left_jacobian(h * load3(w, action + 3))
                    add3(w, out + 3, h * (turn.transpose() @ (r @ moment)))
                    add3(w, old + 6 * edge + 3, moment)
                    longer = (1.0 - 2.0 * end) / (n - 1) * (r.transpose() @ inner)
                    for p in range(ni[at.PARAMETERS]):
                        if ni[parameter_code_at(ni, p)] == at.LENGTH_PARAMETER:
                            to = rod + ni[at.AT_PARAMETERS_OUT] + p
                            w[to] = w[to] + longer[2]
                add3(w, out, h * pull)
                add3(w, old + outer, pull)
    else:
        result = parameter_forces(ni, w, task, rod, step, arg, real)
    return result


@ti.real_func
def adjoint(
    ni: Integers, w: Doubles, task: ti.i32, rod: ti.i32, step: ti.i32, arg: ti.i32, real: ti.f64
) -> ti.f64:
    """From the cost's slope after a solve to its slope after those before."""
    result = 0.0
    if task == at.ADJOINT:
        n = ni[at.NODES]
        count = 2 * n - 1
        first = ni[at.FIRST_FREE]
        end = ni[at.END_FREE]
        _h, weight, carry = step_times(ni, w, rod, step)
        new = rod + ni[at.AT_ADJOINT] + 3 * count * (step + at.NEW)
        for j in range(ti.max(first - 2, 0), first):
            for k in range(2):
                to = j + 1 + k
                if to >= first and to < end:
                    m = hessian_at(ni, rod, step, j) + 9 + 9 * k
                    add3(w, new + 3 * j, -(load33(w, m).transpose() @ load3(w, new + 3 * to)))
        for j in range(ti.max(end - 2, first), end):
            for k in range(2):
                to = j + 1 + k
                if to >= end and to < count:
                    m = hessian_at(ni, rod, step, j) + 9 + 9 * k
                    add3(w, new + 3 * to, -(load33(w, m) @ load3(w, new + 3 * j)))
        for j in range(first, end):
            i = j // 2
            v = load3(w, new + 3 * j)
            for back in range(1, ni[at.HISTORY] + 1):
                old = new - 3 * count * back + 3 * j
                if j % 2 == 0:
                    mass = weight * w[rod + ni[at.AT_MASSES] + i]
                    add3(w, old, (mass * target_share(ni, w, rod, step, back, carry)) * v)
                else:
                    c = rod + ni[at.AT_INERTIA_COUPLINGS] + 9 * (at.NEW * i + back - 1)
                    add3(w, old, -(load33(w, c).transpose() @ v))
        rate = internal_rate(ni, w, rod, step)
        if rate > 0.0:
            for i in range(n - 2):
                j = 2 * i + 1
                after = rod + ni[at.AT_BEND_JACOBIANS] + 27 * i
                jacobian = load33(w, after)
                moment = ti.Vector([0.0, 0.0, 0.0])
                if j >= first:
                    moment -= jacobian @ load3(w, new + 3 * j)
                if j + 2 < end:
                    moment += jacobian.transpose() @ load3(w, new + 3 * j + 6)
                moment *= rate * load3(w, rod + ni[at.AT_BENDS] + 6 * i)
                for back in range(1, 3):
                    share = w[time_at(ni, rod, step) + at.BASE + back - 1]
                    old = new - 3 * count * back + 3 * j
                    jacobian = share * load33(w, after + 9 * back)
                    add3(w, old, -(jacobian.transpose() @ moment))
                    add3(w, old + 6, jacobian @ moment)
        for p in range(ni[at.PARAMETERS]):
            force = parameter_forces_at(ni, rod, p // 6, 0) + p % 6
            total = 0.0
            for j in range(first, end):
                for a in ti.static(range(3)):
                    total -= w[new + 3 * j + a] * w[force + 18 * j + 6 * a]
            to = rod + ni[at.AT_PARAMETERS_OUT] + p
            w[to] = w[to] + total
    else:
        result = grip_adjoint(ni, w, task, rod, step, arg, real)
    return result
