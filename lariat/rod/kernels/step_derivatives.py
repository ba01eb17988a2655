"""How the gradient of a step answers the steps before and the parameters."""

import taichi as ti

from lariat.rod.kernels.access import (
    bend_turn,
    inertia_coupling,
    inertia_terms,
    internal_rate,
    orientation_at,
    past_turn,
    position_at,
    scalar,
    step_times,
    target_share,
    time_at,
)
from lariat.rod.kernels.newton_update import subtract_couplings
from lariat.rod.kernels.rotations import (
    exponential,
    left_jacobian,
    left_jacobian_inverse,
    load3,
    load4,
    log_coefficients,
    logarithm,
    rotation_matrix,
    store3,
    store33,
)
from lariat.rod.kernels.types import Doubles, Integers
from lariat.rod.launch.codes import Parameter, Task
from lariat.rod.launch.layout import (
    EFFECTIVE_BEND_WIDTH,
    HISTORY_SLOTS,
    PARAMETER_WIDTH,
    STEP_BLOCKS,
    Header,
    Scalar,
    Section,
    TimeRow,
)


@ti.func
def parameter_forces_at(ni: ti.template(), rod, group, j):
    """Where the rows of a block begin, for six parameters."""
    count = 2 * ni[Header.NODES] - 1
    return rod + ni[Section.PARAMETER_DERIVATIVES] + 18 * (group * count + j)


@ti.func
def parameter_code_at(ni: ti.template(), p):
    """Where code, knot and count of knots of a parameter lie, in the integer array."""
    return STEP_BLOCKS + ni[Header.HORIZON] + PARAMETER_WIDTH * p


@ti.func
def add_parameter_force(ni: ti.template(), w: ti.template(), rod, p, j, v):
    start = parameter_forces_at(ni, rod, p // 6, j) + p % 6
    for a in ti.static(range(3)):
        w[start + 6 * a] = w[start + 6 * a] + v[a]


@ti.real_func
def couple_inertia(
    ni: Integers, w: Doubles, task: ti.i32, rod: ti.i32, step: ti.i32, arg: ti.i32, real: ti.f64
) -> ti.f64:
    """d gradient / d rotation in the solves before; J_l^-1 of bends after and before."""
    result = 0.0
    if task == Task.INERTIA_DERIVATIVES:
        n = ni[Header.NODES]
        history = ni[Header.HISTORY]
        _h, _weight, carry = step_times(ni, w, rod, step)
        for i in range(n - 1):
            # In the chart of the last orientation: theta = log(conj(q1) q), turn = sum of shares.
            turn = ti.Vector([0.0, 0.0, 0.0])
            slope = ti.Vector([0.0, 0.0, 0.0])
            for back in range(2, history + 1):
                theta = logarithm(past_turn(ni, w, rod, step, i, back))
                turn += target_share(ni, w, rod, step, back, carry) * theta
                slope += w[time_at(ni, rod, step) + TimeRow.MOMENTUM_SHARES + back - 1] * theta
            answer = inertia_coupling(ni, w, rod, step, i)
            through = answer @ left_jacobian(turn).transpose()
            store3(w, rod + ni[Section.TARGET_DERIVATIVES] + 3 * i, through @ slope)
            to = rod + ni[Section.INERTIA_COUPLINGS] + 9 * HISTORY_SLOTS * i
            latest = answer @ rotation_matrix(exponential(turn)).transpose()
            for back in range(2, history + 1):
                u = past_turn(ni, w, rod, step, i, back)
                theta = logarithm(u)
                c, _d = log_coefficients(u)
                inverse = left_jacobian_inverse(theta, c)
                share = target_share(ni, w, rod, step, back, carry)
                store33(w, to + 9 * (back - 1), share * (through @ inverse.transpose()))
                latest -= share * (through @ inverse)
            store33(w, to, latest)
        if internal_rate(ni, w, rod, step) > 0.0:
            for k in range(3 * (n - 2)):
                _y, jacobian, _c, _d = bend_turn(ni, w, rod, step + HISTORY_SLOTS - k % 3, k // 3)
                store33(w, rod + ni[Section.BEND_JACOBIANS] + 9 * k, jacobian)
        # Room for the forces of contact alone.
        for k in range(3 * (2 * n - 1)):
            w[rod + ni[Section.GRADIENT] + k] = 0.0
    else:
        result = subtract_couplings(ni, w, task, rod, step, arg, real)
    return result


@ti.real_func
def parameter_forces(
    ni: Integers, w: Doubles, task: ti.i32, rod: ti.i32, step: ti.i32, arg: ti.i32, real: ti.f64
) -> ti.f64:
    """d gradient / d parameter for every parameter that was asked for."""
    result = 0.0
    if task == Task.PARAMETER_DERIVATIVES:
        n = ni[Header.NODES]
        count = ni[Header.PARAMETERS]
        stretch = scalar(ni, w, rod, Scalar.STRETCH_STIFFNESS)
        length = scalar(ni, w, rod, Scalar.EDGE_LENGTH)
        h, weight, carry = step_times(ni, w, rod, step)
        damped = 1.0 + scalar(ni, w, rod, Scalar.DAMPING) * h
        density = scalar(ni, w, rod, Scalar.LINEAR_DENSITY)
        gravity = ti.Vector(
            [
                scalar(ni, w, rod, Scalar.GRAVITY_X),
                scalar(ni, w, rod, Scalar.GRAVITY_Y),
                scalar(ni, w, rod, Scalar.GRAVITY_Z),
            ]
        )
        for k in range(18 * ((count + 5) // 6) * (2 * n - 1)):
            w[parameter_forces_at(ni, rod, 0, 0) + k] = 0.0
        for p in range(count):
            code = ni[parameter_code_at(ni, p)]
            knot = ni[parameter_code_at(ni, p) + 1]
            knots = ni[parameter_code_at(ni, p) + 2]
            if code == Parameter.STRETCH_STIFFNESS or code == Parameter.LENGTH:
                for i in range(n - 1):
                    q = load4(w, orientation_at(ni, rod, step + HISTORY_SLOTS, i))
                    r = rotation_matrix(q)
                    edge = load3(w, position_at(ni, rod, step + HISTORY_SLOTS, i + 1)) - load3(
                        w, position_at(ni, rod, step + HISTORY_SLOTS, i)
                    )
                    strain = edge / length - ti.Vector([r[0, 2], r[1, 2], r[2, 2]])
                    force = strain
                    moment = ti.Vector([0.0, 0.0, 0.0])
                    if code == Parameter.STRETCH_STIFFNESS:
                        local = r.transpose() @ strain
                        moment = ti.Vector([length * local[1], -length * local[0], 0.0])
                    else:
                        force = -(stretch / (length * length * (n - 1))) * edge
                    add_parameter_force(ni, w, rod, p, 2 * i, -force)
                    add_parameter_force(ni, w, rod, p, 2 * i + 2, force)
                    add_parameter_force(ni, w, rod, p, 2 * i + 1, moment)
            inertial = (
                code == Parameter.DAMPING
                or code == Parameter.LINEAR_DENSITY
                or code == Parameter.LENGTH
            )
            # Mass, weight and contact all grow with the length.
            per_length = 1.0 / (length * (n - 1))
            if inertial or code == Parameter.DENSITY_PROFILE:
                for i in range(n):
                    mass = w[rod + ni[Section.MASSES] + i]
                    x = load3(w, position_at(ni, rod, step + HISTORY_SLOTS, i))
                    away = x - load3(w, rod + ni[Section.TARGET_POSITIONS] + 3 * i)
                    force = mass * (weight * away - gravity)
                    if code == Parameter.DAMPING:
                        for back in range(1, 3):
                            share = w[time_at(ni, rod, step) + TimeRow.BASE_SHARES + back - 1]
                            x -= share * load3(
                                w, position_at(ni, rod, step + HISTORY_SLOTS - back, i)
                            )
                        force = (mass / h) * x
                    elif code == Parameter.LENGTH:
                        force += load3(w, rod + ni[Section.GRADIENT] + 6 * i)
                        force *= per_length
                    elif code == Parameter.LINEAR_DENSITY:
                        force /= density
                    else:
                        share = 1.0
                        if knots > 1:
                            place = ti.cast(i * (knots - 1), ti.f64) / (n - 1)
                            share = ti.max(0.0, 1.0 - ti.abs(place - knot))
                        if i == 0 or i == n - 1:
                            share *= 0.5
                        force *= share * density * length / mass
                    add_parameter_force(ni, w, rod, p, 2 * i, force)
            if inertial:
                for i in range(n - 1):
                    _re, im, inertia, turn = inertia_terms(
                        ni,
                        w,
                        rod,
                        weight,
                        load4(w, orientation_at(ni, rod, step + HISTORY_SLOTS, i)),
                        load4(w, rod + ni[Section.TARGET_ORIENTATIONS] + 4 * i),
                    )
                    moment = turn.transpose() @ (2.0 * inertia * im)
                    if code == Parameter.LINEAR_DENSITY:
                        moment /= density
                    elif code == Parameter.LENGTH:
                        moment *= per_length
                    else:
                        moment *= h / damped
                        slope = load3(w, rod + ni[Section.TARGET_DERIVATIVES] + 3 * i)
                        moment -= (h * carry * carry) * slope
                    add_parameter_force(ni, w, rod, p, 2 * i + 1, moment)
            if (
                code == Parameter.BENDING_STIFFNESS
                or code == Parameter.TWISTING_STIFFNESS
                or code == Parameter.INTERNAL_DAMPING
                or (code >= Parameter.LENGTH and code != Parameter.DENSITY_PROFILE)
            ):
                for j in range(n - 2):
                    y, jacobian, _c, _d = bend_turn(ni, w, rod, step + HISTORY_SLOTS, j)
                    bend = rod + ni[Section.BENDS] + 6 * j
                    stiffness = load3(w, bend)
                    rest = load3(w, bend + 3)
                    # How much of the value at a knot counts here.
                    share = 1.0
                    if knots > 1:
                        place = ti.cast((j + 1) * (knots - 1), ti.f64) / (n - 1)
                        share = ti.max(0.0, 1.0 - ti.abs(place - knot))
                    effective = rod + ni[Section.EFFECTIVE_BENDS] + EFFECTIVE_BEND_WIDTH * j
                    moment = load3(w, effective) * (y - load3(w, effective + 3))
                    if code == Parameter.BENDING_STIFFNESS:
                        moment *= share / scalar(ni, w, rod, Scalar.BENDING_STIFFNESS)
                        moment[2] = 0.0
                    elif code == Parameter.TWISTING_STIFFNESS:
                        moment *= share / scalar(ni, w, rod, Scalar.TWISTING_STIFFNESS)
                        moment[0] = 0.0
                        moment[1] = 0.0
                    elif code == Parameter.STIFFNESS_PROFILE:
                        moment *= (
                            share
                            * scalar(ni, w, rod, Scalar.BENDING_STIFFNESS)
                            / (length * stiffness[0])
                        )
                    elif code == Parameter.INTERNAL_DAMPING:
                        carries = w[time_at(ni, rod, step) + TimeRow.KEEPS_VELOCITY]
                        moment = (carries / h) * stiffness * (y - load3(w, effective + 6))
                    elif code == Parameter.LENGTH:
                        moment = -per_length * (moment + stiffness * rest)
                    else:
                        for a in ti.static(range(3)):
                            moment[a] = 0.0
                            if code == Parameter.REST_CURVATURE + a:
                                moment[a] = -share * stiffness[a] * length
                    add_parameter_force(ni, w, rod, p, 2 * j + 1, -(jacobian.transpose() @ moment))
                    add_parameter_force(ni, w, rod, p, 2 * j + 3, jacobian @ moment)
    else:
        result = couple_inertia(ni, w, task, rod, step, arg, real)
    return result
