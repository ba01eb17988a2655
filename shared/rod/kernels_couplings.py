# type: ignore
"""How the gradient of a step answers the steps before and the parameters."""

import taichi as ti

from shared.rod import layout as at
from shared.rod.kernels_access import (
    bend_turn,
    inertia_coupling,
    inertia_terms,
    internal_rate,
    last_turn,
    orientation_at,
    position_at,
    scalar,
    step_times,
    target_orientation,
)
from shared.rod.kernels_band import solve
from shared.rod.kernels_math import (
    exponential,
    left_jacobian,
    left_jacobian_inverse,
    load3,
    load4,
    log_coefficients,
    logarithm,
    rotation_matrix,
    store33,
)
from shared.rod.kernels_types import Doubles, Integers


@ti.func
def parameter_forces_at(ni: ti.template(), rod, step, group, j):
    """Where the rows of a block begin, for six parameters."""
    groups = (ni[at.PARAMETERS] + 5) // 6
    count = 2 * ni[at.NODES] - 1
    return rod + ni[at.AT_PARAMETER_FORCES] + 18 * ((step * groups + group) * count + j)


@ti.func
def parameter_code_at(ni: ti.template(), p):
    """Where code, knot and count of knots of a parameter lie, in the integer array."""
    return at.INTEGERS + ni[at.HORIZON] + at.PARAMETER_WIDTH * p


@ti.func
def add_parameter_force(ni: ti.template(), w: ti.template(), rod, step, p, j, v):
    start = parameter_forces_at(ni, rod, step, p // 6, j) + p % 6
    for a in ti.static(range(3)):
        w[start + 6 * a] += v[a]


@ti.real_func
def couple_inertia(
    ni: Integers, w: Doubles, task: ti.i32, rod: ti.i32, step: ti.i32, arg: ti.i32, real: ti.f64
) -> ti.f64:
    """d gradient / d rotation one and two steps before; J_l^-1 of bends after and before."""
    result = 0.0
    if task == at.INERTIA:
        _h, _weight, carry = step_times(ni, w, rod, step)
        n = ni[at.NODES]
        for i in range(n - 1):
            answer = inertia_coupling(ni, w, rod, step, i)
            u = last_turn(ni, w, rod, step, i)
            y = logarithm(u)
            c, _d = log_coefficients(y.dot(y), u)
            inverse = left_jacobian_inverse(y, c)
            through = carry * left_jacobian(carry * y).transpose()
            turn = rotation_matrix(exponential(carry * y)).transpose()
            to = rod + ni[at.AT_INERTIA_COUPLINGS] + 18 * (step * (n - 1) + i)
            store33(w, to, answer @ (turn + through @ inverse.transpose()))
            store33(w, to + 9, -(answer @ (through @ inverse)))
        if internal_rate(ni, w, rod, step) > 0.0:
            for k in range(2 * (n - 2)):
                _y, jacobian, _c, _d = bend_turn(ni, w, rod, step + 2 - k % 2, k // 2)
                to = rod + ni[at.AT_BEND_JACOBIANS] + 18 * step * (n - 2) + 9 * k
                store33(w, to, jacobian)
    else:
        result = solve(ni, w, task, rod, step, arg, real)
    return result


@ti.real_func
def parameter_forces(
    ni: Integers, w: Doubles, task: ti.i32, rod: ti.i32, step: ti.i32, arg: ti.i32, real: ti.f64
) -> ti.f64:
    """d gradient / d parameter for every parameter that was asked for."""
    result = 0.0
    if task == at.PARAMETER_FORCES:
        n = ni[at.NODES]
        count = ni[at.PARAMETERS]
        stretch = scalar(ni, w, rod, at.STRETCH)
        length = scalar(ni, w, rod, at.EDGE_LENGTH)
        h, weight, carry = step_times(ni, w, rod, step)
        rate = internal_rate(ni, w, rod, step)
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
            code = ni[parameter_code_at(ni, p)]
            knot = ni[parameter_code_at(ni, p) + 1]
            knots = ni[parameter_code_at(ni, p) + 2]
            if code == at.STRETCH_PARAMETER or code == at.LENGTH_PARAMETER:
                for i in range(n - 1):
                    q = load4(w, orientation_at(ni, rod, step + 2, i))
                    r = rotation_matrix(q)
                    edge = load3(w, position_at(ni, rod, step + 2, i + 1)) - load3(
                        w, position_at(ni, rod, step + 2, i)
                    )
                    strain = edge / length - ti.Vector([r[0, 2], r[1, 2], r[2, 2]])
                    force = strain
                    moment = ti.Vector([0.0, 0.0, 0.0])
                    if code == at.STRETCH_PARAMETER:
                        local = r.transpose() @ strain
                        moment = ti.Vector([length * local[1], -length * local[0], 0.0])
                    else:
                        # Inertia, weight and contact grow with the length, and in balance
                        # they are the opposite of this force.
                        force = -(stretch / (length * (n - 1))) * (strain + edge / length)
                    add_parameter_force(ni, w, rod, step, p, 2 * i, -force)
                    add_parameter_force(ni, w, rod, step, p, 2 * i + 2, force)
                    add_parameter_force(ni, w, rod, step, p, 2 * i + 1, moment)
            if (
                code == at.DAMPING_PARAMETER
                or code == at.DENSITY_PARAMETER
                or code == at.DENSITY_PROFILE_PARAMETER
            ):
                for i in range(n):
                    mass = w[rod + ni[at.AT_MASSES] + i]
                    x0 = load3(w, position_at(ni, rod, step, i))
                    x1 = load3(w, position_at(ni, rod, step + 1, i))
                    x = load3(w, position_at(ni, rod, step + 2, i))
                    force = (mass / h) * (x - x1)
                    if code != at.DAMPING_PARAMETER:
                        away = x - x1 - carry * (x1 - x0)
                        if code == at.DENSITY_PARAMETER:
                            mass /= density
                        else:
                            share = 1.0
                            if knots > 1:
                                place = ti.cast(i * (knots - 1), ti.f64) / (n - 1)
                                share = ti.max(0.0, 1.0 - ti.abs(place - knot))
                            mass = share * density * length
                            if i == 0 or i == n - 1:
                                mass *= 0.5
                        force = mass * (weight * away - gravity)
                    add_parameter_force(ni, w, rod, step, p, 2 * i, force)
            if (
                code == at.DAMPING_PARAMETER
                or code == at.DENSITY_PARAMETER
                or code == at.LENGTH_PARAMETER
            ):
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
                    elif code == at.LENGTH_PARAMETER:
                        moment /= length * (n - 1)
                    else:
                        moment *= h / damped
                        answer = inertia_coupling(ni, w, rod, step, i)
                        y = logarithm(last_turn(ni, w, rod, step, i))
                        moment -= (h * carry / damped) * (answer @ y)
                    add_parameter_force(ni, w, rod, step, p, 2 * i + 1, moment)
            if (
                code == at.BENDING_PARAMETER
                or code == at.TWISTING_PARAMETER
                or code == at.INTERNAL_DAMPING_PARAMETER
                or (code >= at.LENGTH_PARAMETER and code != at.DENSITY_PROFILE_PARAMETER)
            ):
                for j in range(n - 2):
                    y, jacobian, _c, _d = bend_turn(ni, w, rod, step + 2, j)
                    y1, _before, _c1, _d1 = bend_turn(ni, w, rod, step + 1, j)
                    bend = rod + ni[at.AT_BENDS] + 6 * j
                    stiffness = load3(w, bend)
                    rest = load3(w, bend + 3)
                    # How much of the value at a knot counts here.
                    share = 1.0
                    if knots > 1:
                        place = ti.cast((j + 1) * (knots - 1), ti.f64) / (n - 1)
                        share = ti.max(0.0, 1.0 - ti.abs(place - knot))
                    moment = stiffness * (y - rest + rate * (y - y1))
                    if code == at.BENDING_PARAMETER:
                        moment *= share / scalar(ni, w, rod, at.BENDING)
                        moment[2] = 0.0
                    elif code == at.TWISTING_PARAMETER:
                        moment *= share / scalar(ni, w, rod, at.TWISTING)
                        moment[0] = 0.0
                        moment[1] = 0.0
                    elif code == at.PROFILE_PARAMETER:
                        moment *= share * scalar(ni, w, rod, at.BENDING) / (length * stiffness[0])
                    elif code == at.INTERNAL_DAMPING_PARAMETER:
                        flag = w[rod + ni[at.AT_TIMES] + 2 * step + 1]
                        moment = (flag / h) * stiffness * (y - y1)
                    elif code == at.LENGTH_PARAMETER:
                        moment = -(moment + stiffness * rest) / (length * (n - 1))
                    else:
                        for a in ti.static(range(3)):
                            moment[a] = 0.0
                            if code == at.CURVATURE_PARAMETER + a:
                                moment[a] = -share * stiffness[a] * length
                    add_parameter_force(
                        ni, w, rod, step, p, 2 * j + 1, -(jacobian.transpose() @ moment)
                    )
                    add_parameter_force(ni, w, rod, step, p, 2 * j + 3, jacobian @ moment)
    else:
        result = couple_inertia(ni, w, task, rod, step, arg, real)
    return result
