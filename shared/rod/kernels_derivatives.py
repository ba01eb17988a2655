# type: ignore
"""Derivatives of a roll-out by the implicit function theorem.

At the end of a step the gradient g(z; z1, z0, a, p) of its energy vanishes, so that
H dz = -(dg/dz1 dz1 + dg/dz0 dz0 + dg/dp dp) on the free blocks, with the factors that the last
Newton iteration left behind. Forward sensitivities carry dz along for six columns at a time; the
adjoint walks back with one vector. Tangent vectors of edges are in the edges' own frames.
"""

import taichi as ti

from shared.rod import layout as at
from shared.rod.kernels_math import (
    add3,
    cross_matrix,
    exponential,
    left_jacobian,
    left_jacobian_inverse,
    load3,
    load4,
    load33,
    logarithm,
    relative,
    rotation_matrix,
    store33,
)
from shared.rod.kernels_newton import (
    bend_terms,
    hessian_at,
    inertia_terms,
    orientation_at,
    position_at,
    scalar,
    solve,
    step_times,
)
from shared.rod.kernels_types import Doubles, Integers


@ti.func
def inertia_coupling(ni: ti.template(), w: ti.template(), rod, step, i):
    """How the gradient at edge i answers turns of its orientation target."""
    _h, weight, _carry = step_times(ni, w, rod, step)
    _re, im, inertia, turn = inertia_terms(
        ni,
        w,
        rod,
        weight,
        load4(w, orientation_at(ni, rod, step + 2, i)),
        target_orientation(ni, w, rod, step, i),
    )
    momentum = 2.0 * inertia * im
    answer = cross_matrix(momentum)
    for a in ti.static(range(3)):
        for b in ti.static(range(3)):
            answer[a, b] += 2.0 * turn[b, a] * inertia[b]
    return 0.5 * (momentum.outer_product(im) - answer @ turn.transpose())


@ti.func
def spin(ni: ti.template(), w: ti.template(), rod, step, i):
    """Rotation of edge i in the step before, in its own frame."""
    return logarithm(
        relative(
            load4(w, orientation_at(ni, rod, step, i)),
            load4(w, orientation_at(ni, rod, step + 1, i)),
        )
    )


@ti.func
def target_orientation(ni: ti.template(), w: ti.template(), rod, step, i):
    _h, _weight, carry = step_times(ni, w, rod, step)
    q1 = load4(w, orientation_at(ni, rod, step + 1, i))
    turn = exponential(carry * spin(ni, w, rod, step, i))
    w0, x0, y0, z0 = q1[0], q1[1], q1[2], q1[3]
    w1, x1, y1, z1 = turn[0], turn[1], turn[2], turn[3]
    return ti.Vector(
        [
            w0 * w1 - x0 * x1 - y0 * y1 - z0 * z1,
            w0 * x1 + x0 * w1 + y0 * z1 - z0 * y1,
            w0 * y1 - x0 * z1 + y0 * w1 + z0 * x1,
            w0 * z1 + x0 * y1 - y0 * x1 + z0 * w1,
        ]
    )


@ti.real_func
def couple_inertia(ni: Integers, w: Doubles, rod: ti.i32, step: ti.i32):
    """For every edge: d gradient / d rotation one step and two steps before."""
    _h, _weight, carry = step_times(ni, w, rod, step)
    n = ni[at.NODES]
    for i in range(n - 1):
        answer = inertia_coupling(ni, w, rod, step, i)
        y = spin(ni, w, rod, step, i)
        inverse = left_jacobian_inverse(y)
        through = carry * left_jacobian(carry * y).transpose()
        turn = rotation_matrix(exponential(carry * y)).transpose()
        c = rod + ni[at.AT_INERTIA_COUPLINGS] + 18 * (step * (n - 1) + i)
        store33(w, c, answer @ (turn + through @ inverse.transpose()))
        store33(w, c + 9, -(answer @ (through @ inverse)))


@ti.func
def parameter_forces_at(ni: ti.template(), rod, step, group, j):
    """Where the rows of a block begin, for six parameters."""
    groups = (ni[at.PARAMETERS] + 5) // 6
    count = 2 * ni[at.NODES] - 1
    return rod + ni[at.AT_PARAMETER_FORCES] + 18 * ((step * groups + group) * count + j)


@ti.func
def add_parameter_force(ni: ti.template(), w: ti.template(), rod, step, p, j, v):
    start = parameter_forces_at(ni, rod, step, p // 6, j) + p % 6
    for a in ti.static(range(3)):
        w[start + 6 * a] += v[a]


@ti.real_func
def parameter_forces(ni: Integers, w: Doubles, rod: ti.i32, step: ti.i32):
    """d gradient / d parameter for every parameter that was asked for."""
    n = ni[at.NODES]
    count = ni[at.PARAMETERS]
    length = scalar(ni, w, rod, at.EDGE_LENGTH)
    h, weight, carry = step_times(ni, w, rod, step)
    damped = 1.0 + scalar(ni, w, rod, at.DAMPING) * h
    density = scalar(ni, w, rod, at.DENSITY)
    gravity = ti.Vector(
        [
            scalar(ni, w, rod, at.GRAVITY_X),
            scalar(ni, w, rod, at.GRAVITY_Y),
            scalar(ni, w, rod, at.GRAVITY_Z),
        ]
    )
    for k in range(18 * ((count + 5) // 6) * (2 * n - 1)):
        w[parameter_forces_at(ni, rod, step, 0, 0) + k] = 0.0
    for p in range(count):
        code = ni[at.INTEGERS + ni[at.HORIZON] + p]
        if code == at.STRETCH_PARAMETER:
            for i in range(n - 1):
                q = load4(w, orientation_at(ni, rod, step + 2, i))
                r = rotation_matrix(q)
                edge = load3(w, position_at(ni, rod, step + 2, i + 1)) - load3(
                    w, position_at(ni, rod, step + 2, i)
                )
                strain = edge / length - ti.Vector([r[0, 2], r[1, 2], r[2, 2]])
                local = r.transpose() @ strain
                add_parameter_force(ni, w, rod, step, p, 2 * i, -strain)
                add_parameter_force(ni, w, rod, step, p, 2 * i + 2, strain)
                moment = ti.Vector([length * local[1], -length * local[0], 0.0])
                add_parameter_force(ni, w, rod, step, p, 2 * i + 1, moment)
        elif code == at.DAMPING_PARAMETER or code == at.DENSITY_PARAMETER:
            for i in range(n):
                mass = w[rod + ni[at.AT_MASSES] + i]
                x0 = load3(w, position_at(ni, rod, step, i))
                x1 = load3(w, position_at(ni, rod, step + 1, i))
                x = load3(w, position_at(ni, rod, step + 2, i))
                force = (mass / h) * (x - x1)
                if code == at.DENSITY_PARAMETER:
                    away = x - x1 - carry * (x1 - x0)
                    force = (mass / density) * (weight * away - gravity)
                add_parameter_force(ni, w, rod, step, p, 2 * i, force)
            for i in range(n - 1):
                _re, im, inertia, turn = inertia_terms(
                    ni,
                    w,
                    rod,
                    weight,
                    load4(w, orientation_at(ni, rod, step + 2, i)),
                    target_orientation(ni, w, rod, step, i),
                )
                moment = turn.transpose() @ (2.0 * inertia * im)
                if code == at.DENSITY_PARAMETER:
                    moment /= density
                else:
                    moment *= h / damped
                    answer = inertia_coupling(ni, w, rod, step, i)
                    moment -= (h * carry / damped) * (answer @ spin(ni, w, rod, step, i))
                add_parameter_force(ni, w, rod, step, p, 2 * i + 1, moment)
        else:
            for j in range(n - 2):
                y, moment, jacobian, stiffness = bend_terms(ni, w, rod, step + 2, j)
                if code == at.BENDING_PARAMETER:
                    moment /= scalar(ni, w, rod, at.BENDING)
                    moment[2] = 0.0
                elif code == at.TWISTING_PARAMETER:
                    moment[0] = 0.0
                    moment[1] = 0.0
                    moment /= scalar(ni, w, rod, at.TWISTING)
                else:
                    for a in ti.static(range(3)):
                        moment[a] = 0.0
                        if code == at.CURVATURE_PARAMETER + a:
                            moment[a] = -stiffness[a] * length
                add_parameter_force(
                    ni, w, rod, step, p, 2 * j + 1, -(jacobian.transpose() @ moment)
                )
                add_parameter_force(ni, w, rod, step, p, 2 * j + 3, jacobian @ moment)


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
    ni: Integers,
    w: Doubles,
    rod: ti.i32,
    step: ti.i32,
    group: ti.i32,
    end: ti.i32,
    new: ti.i32,
    old: ti.i32,
):
    """Rows of the driven blocks of one end, from the same rows one step before."""
    n = ni[at.NODES]
    kind = ni[at.LEFT + end]
    h, _weight, _carry = step_times(ni, w, rod, step)
    block = ni[at.INTEGERS + step // ni[at.SUBSTEPS]]
    driven = 0.0
    if group == 2 * block + end:
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
                    moved[a, b] += reach * (r[a, 0] * turned[1, b] - r[a, 1] * turned[0, b])
            store36(w, new + inner, moved)


@ti.real_func
def sensitivities(ni: Integers, w: Doubles, rod: ti.i32, step: ti.i32):
    """Carry all columns over one step; at the end of a control step write them out."""
    n = ni[at.NODES]
    count = 2 * n - 1
    first = ni[at.FIRST_FREE]
    end = ni[at.END_FREE]
    groups = 2 * ni[at.BLOCKS] + (ni[at.PARAMETERS] + 5) // 6
    block = ni[at.INTEGERS + step // ni[at.SUBSTEPS]]
    _h, weight, carry = step_times(ni, w, rod, step)
    for group in range(groups):
        is_parameter = group >= 2 * ni[at.BLOCKS]
        alive = is_parameter
        if not is_parameter:
            alive = group // 2 <= block and ni[at.LEFT + group % 2] != at.FREE
        if alive:
            start = rod + ni[at.AT_SENSITIVITIES] + 54 * count * group
            new = start + 18 * count * ((step + 2) % 3)
            old = start + 18 * count * ((step + 1) % 3)
            older = start + 18 * count * (step % 3)
            for side in range(2):
                grip_sensitivities(ni, w, rod, step, group, side, new, old)
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
                if is_parameter:
                    force = parameter_forces_at(ni, rod, step, group - 2 * ni[at.BLOCKS], j)
                    add36(w, new + 18 * j, -load36(w, force))
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


@ti.real_func
def grip_adjoint(
    ni: Integers, w: Doubles, rod: ti.i32, step: ti.i32, end: ti.i32, new: ti.i32, old: ti.i32
):
    """Fold the adjoint of the driven blocks of one end into its action and the step before."""
    n = ni[at.NODES]
    kind = ni[at.LEFT + end]
    h, _weight, _carry = step_times(ni, w, rod, step)
    block = ni[at.INTEGERS + step // ni[at.SUBSTEPS]]
    action = rod + ni[at.AT_ACTIONS] + 12 * block + 6 * end
    out = rod + ni[at.AT_ACTIONS_OUT] + 12 * block + 6 * end
    if kind != at.FREE:
        outer = 6 * end * (n - 1)
        pull = load3(w, new + outer)
        if kind == at.CLAMPED:
            edge = end * (n - 2)
            inner = load3(w, new + 6 * (1 + end * (n - 3)))
            pull += inner
            r = rotation_matrix(load4(w, orientation_at(ni, rod, step + 2, edge)))
            reach = scalar(ni, w, rod, at.EDGE_LENGTH) * (1.0 - 2.0 * end)
            local = reach * (r.transpose() @ inner)
            moment = load3(w, new + 6 * edge + 3) + ti.Vector([-local[1], local[0], 0.0])
            turn = left_jacobian(h * load3(w, action + 3))
            add3(w, out + 3, h * (turn.transpose() @ (r @ moment)))
            add3(w, old + 6 * edge + 3, moment)
        add3(w, out, h * pull)
        add3(w, old + outer, pull)


@ti.real_func
def adjoint_step(ni: Integers, w: Doubles, rod: ti.i32, step: ti.i32):
    """From the cost's slope at the end of a step to its slope one and two steps before."""
    n = ni[at.NODES]
    count = 2 * n - 1
    first = ni[at.FIRST_FREE]
    end = ni[at.END_FREE]
    _h, weight, carry = step_times(ni, w, rod, step)
    new = rod + ni[at.AT_ADJOINT] + 3 * count * (step + 2)
    old = new - 3 * count
    older = old - 3 * count
    if (step + 1) % ni[at.SUBSTEPS] == 0:
        cost = rod + ni[at.AT_COST] + 3 * n * (step // ni[at.SUBSTEPS])
        for i in range(n):
            add3(w, new + 6 * i, load3(w, cost + 3 * i))
    solve(ni, w, rod, step, new)
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
    for side in range(2):
        grip_adjoint(ni, w, rod, step, side, new, old)
    for j in range(first, end):
        i = j // 2
        v = load3(w, new + 3 * j)
        if j % 2 == 0:
            mass = weight * w[rod + ni[at.AT_MASSES] + i]
            add3(w, old + 3 * j, (mass * (1.0 + carry)) * v)
            add3(w, older + 3 * j, -(mass * carry) * v)
        else:
            c = rod + ni[at.AT_INERTIA_COUPLINGS] + 18 * (step * (n - 1) + i)
            add3(w, old + 3 * j, -(load33(w, c).transpose() @ v))
            add3(w, older + 3 * j, -(load33(w, c + 9).transpose() @ v))
    for p in range(ni[at.PARAMETERS]):
        force = parameter_forces_at(ni, rod, step, p // 6, 0) + p % 6
        total = 0.0
        for j in range(first, end):
            for a in ti.static(range(3)):
                total -= w[new + 3 * j + a] * w[force + 18 * j + 6 * a]
        w[rod + ni[at.AT_PARAMETERS_OUT] + p] += total
