# type: ignore
"""Forward sensitivities."""

import taichi as ti

from shared.rod import layout as at
from shared.rod.kernels_access import (
    hessian_at,
    internal_rate,
    orientation_at,
    scalar,
    step_times,
)
from shared.rod.kernels_couplings import (
    parameter_code_at,
    parameter_forces,
    parameter_forces_at,
)
from shared.rod.kernels_math import (
    left_jacobian,
    load3,
    load4,
    load33,
    rotation_matrix,
)
from shared.rod.kernels_types import Doubles, Integers


@ti.func
def load36(w: ti.template(), start):
    m = ti.Matrix.zero(ti.f64, 3, 6)
    for a in ti.static(range(3)):
        for b in ti.static(range(6)):
            m[a, b] = w[start + 6 * a + b]
    return m


@ti.func
def store36(w: ti.template(), start, m):
    for a in ti.static(range(3)):
        for b in ti.static(range(6)):
            w[start + 6 * a + b] = m[a, b]


@ti.func
def add36(w: ti.template(), start, m):
    for a in ti.static(range(3)):
        for b in ti.static(range(6)):
            w[start + 6 * a + b] += m[a, b]


@ti.real_func
def grip_sensitivities(
    ni: Integers, w: Doubles, task: ti.i32, rod: ti.i32, step: ti.i32, arg: ti.i32, real: ti.f64
) -> ti.f64:
    """Rows of driven blocks of every column, from the same rows one step before."""
    result = 0.0
    if task == at.GRIP_SENSITIVITIES:
        n = ni[at.NODES]
        count = 2 * n - 1
        h, _weight, _carry = step_times(ni, w, rod, step)
        block = ni[at.INTEGERS + step // ni[at.SUBSTEPS]]
        actions = ni[at.DRIVEN]
        groups = actions + (ni[at.PARAMETERS] + 5) // 6 + (ni[at.DIRECTIONS] + 5) // 6
        for group in range(groups):
            start = rod + ni[at.AT_SENSITIVITIES] + 54 * count * group
            new = start + 18 * count * ((step + 2) % 3)
            old = start + 18 * count * ((step + 1) % 3)
            for end in range(2):
                kind = ni[at.LEFT + end]
                driven = 0.0
                if group < actions and group == 2 * block + end:
                    driven = h
                if kind != at.FREE:
                    outer = 18 * 2 * end * (n - 1)
                    moved = load36(w, old + outer)
                    for a in ti.static(range(3)):
                        moved[a, a] += driven
                    store36(w, new + outer, moved)
                    if kind == at.CLAMPED:
                        edge = end * (n - 2)
                        rotation = 18 * (2 * edge + 1)
                        inner = 18 * 2 * (1 + end * (n - 3))
                        r = rotation_matrix(load4(w, orientation_at(ni, rod, step + 2, edge)))
                        action = rod + ni[at.AT_ACTIONS] + 12 * block + 6 * end
                        turn = driven * (r.transpose() @ left_jacobian(h * load3(w, action + 3)))
                        turned = load36(w, old + rotation)
                        for a in ti.static(range(3)):
                            for b in ti.static(range(3)):
                                turned[a, 3 + b] += turn[a, b]
                        store36(w, new + rotation, turned)
                        reach = scalar(ni, w, rod, at.EDGE_LENGTH) * (1.0 - 2.0 * end)
                        for a in ti.static(range(3)):
                            for b in ti.static(range(6)):
                                moved[a, b] += reach * (
                                    r[a, 0] * turned[1, b] - r[a, 1] * turned[0, b]
                                )
                        store36(w, new + inner, moved)
                        for p in range(ni[at.PARAMETERS]):
                            code = ni[parameter_code_at(ni, p)]
                            if code == at.LENGTH_PARAMETER and group == actions + p // 6:
                                for a in ti.static(range(3)):
                                    to = new + inner + 6 * a + p % 6
                                    w[to] += (1.0 - 2.0 * end) / (n - 1) * r[a, 2]
    else:
        result = parameter_forces(ni, w, task, rod, step, arg, real)
    return result


@ti.real_func
def sensitivities(
    ni: Integers, w: Doubles, task: ti.i32, rod: ti.i32, step: ti.i32, arg: ti.i32, real: ti.f64
) -> ti.f64:
    """Carry all columns over one step; at the end of a control step write them out."""
    result = 0.0
    if task == at.SENSITIVITIES:
        n = ni[at.NODES]
        count = 2 * n - 1
        first = ni[at.FIRST_FREE]
        end = ni[at.END_FREE]
        driven = ni[at.DRIVEN]
        steady = driven + (ni[at.PARAMETERS] + 5) // 6
        groups = steady + (ni[at.DIRECTIONS] + 5) // 6
        rate = internal_rate(ni, w, rod, step)
        block = ni[at.INTEGERS + step // ni[at.SUBSTEPS]]
        _h, weight, carry = step_times(ni, w, rod, step)
        for group in range(groups):
            alive = group >= driven
            if not alive:
                alive = group // 2 <= block and ni[at.LEFT + group % 2] != at.FREE
            if alive:
                start = rod + ni[at.AT_SENSITIVITIES] + 54 * count * group
                new = start + 18 * count * ((step + 2) % 3)
                old = start + 18 * count * ((step + 1) % 3)
                older = start + 18 * count * (step % 3)
                for j in range(first, end):
                    i = j // 2
                    s1 = load36(w, old + 18 * j)
                    s0 = load36(w, older + 18 * j)
                    if j % 2 == 0:
                        mass = weight * w[rod + ni[at.AT_MASSES] + i]
                        store36(w, new + 18 * j, (mass * (1.0 + carry)) * s1 - (mass * carry) * s0)
                    else:
                        c = rod + ni[at.AT_INERTIA_COUPLINGS] + 18 * (step * (n - 1) + i)
                        store36(w, new + 18 * j, -(load33(w, c) @ s1) - load33(w, c + 9) @ s0)
                    if group >= driven and group < steady:
                        force = parameter_forces_at(ni, rod, step, group - driven, j)
                        add36(w, new + 18 * j, -load36(w, force))
                if rate > 0.0:
                    for i in range(n - 2):
                        j = 2 * i + 1
                        after = rod + ni[at.AT_BEND_JACOBIANS] + 18 * (step * (n - 2) + i)
                        jacobian = load33(w, after + 9)
                        moment = jacobian.transpose() @ load36(w, old + 18 * j + 36)
                        moment -= jacobian @ load36(w, old + 18 * j)
                        for a in ti.static(range(3)):
                            for b in ti.static(range(6)):
                                moment[a, b] *= rate * w[rod + ni[at.AT_BENDS] + 6 * i + a]
                        jacobian = load33(w, after)
                        if j >= first:
                            add36(w, new + 18 * j, -(jacobian.transpose() @ moment))
                        if j + 2 < end:
                            add36(w, new + 18 * j + 36, jacobian @ moment)
                for j in range(ti.max(first - 2, 0), first):
                    v = load36(w, new + 18 * j)
                    for k in range(2):
                        to = j + 1 + k
                        if to >= first and to < end:
                            m = hessian_at(ni, rod, step, j) + 9 + 9 * k
                            add36(w, new + 18 * to, -(load33(w, m) @ v))
                for j in range(ti.max(end - 2, first), end):
                    for k in range(2):
                        to = j + 1 + k
                        if to >= end and to < count:
                            m = hessian_at(ni, rod, step, j) + 9 + 9 * k
                            v = load36(w, new + 18 * to)
                            add36(w, new + 18 * j, -(load33(w, m).transpose() @ v))
                for j in range(first, end):
                    m = hessian_at(ni, rod, step, j)
                    v = load36(w, new + 18 * j)
                    if j + 1 < end:
                        add36(w, new + 18 * j + 18, -(load33(w, m + 9) @ v))
                    if j + 2 < end:
                        add36(w, new + 18 * j + 36, -(load33(w, m + 18) @ v))
                for back in range(end - first):
                    j = end - 1 - back
                    m = hessian_at(ni, rod, step, j)
                    v = load33(w, m) @ load36(w, new + 18 * j)
                    if j + 1 < end:
                        v -= load33(w, m + 9).transpose() @ load36(w, new + 18 * j + 18)
                    if j + 2 < end:
                        v -= load33(w, m + 18).transpose() @ load36(w, new + 18 * j + 36)
                    store36(w, new + 18 * j, v)
                if (step + 1) % ni[at.SUBSTEPS] == 0:
                    out = rod + ni[at.AT_SENSITIVITIES_OUT]
                    out += 18 * groups * n * (step // ni[at.SUBSTEPS]) + 6 * group
                    for i in range(n):
                        for a in ti.static(range(3)):
                            for b in ti.static(range(6)):
                                w[out + 6 * groups * (3 * i + a) + b] = w[new + 36 * i + 6 * a + b]
    else:
        result = grip_sensitivities(ni, w, task, rod, step, arg, real)
    return result
