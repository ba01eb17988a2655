"""Derivative of a step's equation with respect to the parameters, dg/dtheta.

Every term of the energy is linear in its stiffness or its mass, so that its derivative is its own
gradient over the parameter. The profiles are interpolated linearly between their knots.
"""

from lariat.kernel_cache.language import ti
from lariat.rod.kernels.addressing import (
    column_groups,
    effective_bend_at,
    orientation_at,
    parameter_code_at,
    parameter_derivatives_at,
    position_at,
    scalar,
    target_orientation_at,
    target_position_at,
    time_at,
)
from lariat.rod.kernels.air_drag import air_drag_parameter_derivatives
from lariat.rod.kernels.friction import friction_parameter_derivatives
from lariat.rod.kernels.memory import load3, load4
from lariat.rod.kernels.plasticity import (
    bend_length,
    knot_share,
    plastic_parameter_derivatives,
)
from lariat.rod.kernels.rotations import rotation_matrix
from lariat.rod.kernels.step_derivatives import inertia_derivatives
from lariat.rod.kernels.step_terms import (
    add_parameter_derivative,
    bend_rotation,
    step_times,
    turn_from_target,
    weighted_inertia,
)
from lariat.rod.kernels.types import Doubles, Integers, Matrices33
from lariat.rod.launch.codes import Task
from lariat.rod.launch.layout import (
    COLUMNS_WIDTH,
    HISTORY_SLOTS,
    EffectiveBend,
    Header,
    ParameterCode,
    Scalar,
    Section,
    TimeRow,
)


@ti.real_func
def parameter_derivatives(
    ni: Integers,
    w: Doubles,
    w33: Matrices33,
    task: ti.i32,
    rod: ti.i32,
    step: ti.i32,
    arg: ti.i32,
    real: ti.f64,
) -> ti.f64:
    """Compute the derivative of the gradient with respect to every requested parameter."""
    result = 0.0
    if task == Task.PARAMETER_DERIVATIVES:
        n = ni[Header.NODES]
        count = ni[Header.PARAMETERS]
        first_edge = ni[Header.FIRST_EDGE]
        end_edge = ni[Header.END_EDGE]
        edges = end_edge - first_edge
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
        for k in range(COLUMNS_WIDTH * column_groups(count) * (2 * n - 1)):
            w[parameter_derivatives_at(ni, rod, 0, 0) + k] = 0.0
        for p in range(count):
            code = ni[parameter_code_at(ni, p)]
            knot = ni[parameter_code_at(ni, p) + 1]
            knots = ni[parameter_code_at(ni, p) + 2]
            if code == ParameterCode.STRETCH_STIFFNESS or code == ParameterCode.LENGTH:
                for i in range(first_edge, end_edge):
                    q = load4(w, orientation_at(ni, rod, step + HISTORY_SLOTS, i))
                    r = rotation_matrix(q)
                    edge = load3(w, position_at(ni, rod, step + HISTORY_SLOTS, i + 1)) - load3(
                        w, position_at(ni, rod, step + HISTORY_SLOTS, i)
                    )
                    strain = edge / length - ti.Vector([r[0, 2], r[1, 2], r[2, 2]])
                    force = strain
                    moment = ti.Vector([0.0, 0.0, 0.0])
                    if code == ParameterCode.STRETCH_STIFFNESS:
                        local = r.transpose() @ strain
                        moment = ti.Vector([length * local[1], -length * local[0], 0.0])
                    else:
                        force = -(stretch / (length * length * edges)) * edge
                    add_parameter_derivative(ni, w, rod, p, 2 * i, -force)
                    add_parameter_derivative(ni, w, rod, p, 2 * i + 2, force)
                    add_parameter_derivative(ni, w, rod, p, 2 * i + 1, moment)
            inertial = (
                code == ParameterCode.DAMPING
                or code == ParameterCode.LINEAR_DENSITY
                or code == ParameterCode.LENGTH
            )
            # Mass, weight and contact are proportional to the length.
            per_length = 1.0 / (length * edges)
            if inertial or code == ParameterCode.DENSITY_PROFILE:
                for i in range(first_edge, end_edge + 1):
                    mass = w[rod + ni[Section.MASSES] + i]
                    x = load3(w, position_at(ni, rod, step + HISTORY_SLOTS, i))
                    displacement = x - load3(w, target_position_at(ni, rod, step, i))
                    force = mass * (weight * displacement - gravity)
                    if code == ParameterCode.DAMPING:
                        for back in range(1, 3):
                            share = w[time_at(ni, rod, step) + TimeRow.BASE_SHARES + back - 1]
                            x -= share * load3(
                                w, position_at(ni, rod, step + HISTORY_SLOTS - back, i)
                            )
                        force = (mass / h) * x
                    elif code == ParameterCode.LENGTH:
                        force += load3(w, rod + ni[Section.GRADIENT] + 6 * i)
                        force *= per_length
                    elif code == ParameterCode.LINEAR_DENSITY:
                        force /= density
                    else:
                        share = 1.0
                        if knots > 1:
                            coordinate = ti.cast((i - first_edge) * (knots - 1), ti.f64) / edges
                            share = ti.max(0.0, 1.0 - ti.abs(coordinate - knot))
                        if (i - first_edge) % edges == 0:
                            share *= 0.5
                        force *= share * density * length / mass
                    add_parameter_derivative(ni, w, rod, p, 2 * i, force)
            if inertial:
                for i in range(first_edge, end_edge):
                    inertia = weighted_inertia(ni, w, rod, weight)
                    im, momentum_map = turn_from_target(
                        load4(w, orientation_at(ni, rod, step + HISTORY_SLOTS, i)),
                        load4(w, target_orientation_at(ni, rod, step, i)),
                    )
                    moment = momentum_map.transpose() @ (2.0 * inertia * im)
                    if code == ParameterCode.LINEAR_DENSITY:
                        moment /= density
                    elif code == ParameterCode.LENGTH:
                        moment *= per_length
                    else:
                        moment *= h / damped
                        derivative = load3(w, rod + ni[Section.TARGET_DERIVATIVES] + 3 * i)
                        moment -= (h * carry * carry) * derivative
                    add_parameter_derivative(ni, w, rod, p, 2 * i + 1, moment)
            if (
                code == ParameterCode.BENDING_STIFFNESS
                or code == ParameterCode.TWISTING_STIFFNESS
                or code == ParameterCode.INTERNAL_DAMPING
                or (code >= ParameterCode.LENGTH and code < ParameterCode.DENSITY_PROFILE)
            ):
                for j in range(n - 2):
                    u, jacobian, _c, _d = bend_rotation(ni, w, rod, step + HISTORY_SLOTS, j)
                    bend = rod + ni[Section.BENDS] + 6 * j
                    stiffness = load3(w, bend)
                    rest = load3(w, bend + 3)
                    reach = bend_length(ni, w, rod, j)
                    share = knot_share(ni, p, j)
                    effective = effective_bend_at(ni, rod, step, j)
                    moment = load3(w, effective + EffectiveBend.STIFFNESS) * (
                        u - load3(w, effective + EffectiveBend.REST)
                    )
                    if code == ParameterCode.BENDING_STIFFNESS:
                        moment *= share / scalar(ni, w, rod, Scalar.BENDING_STIFFNESS)
                        moment[2] = 0.0
                    elif code == ParameterCode.TWISTING_STIFFNESS:
                        moment *= share / scalar(ni, w, rod, Scalar.TWISTING_STIFFNESS)
                        moment[0] = 0.0
                        moment[1] = 0.0
                    elif code == ParameterCode.STIFFNESS_PROFILE:
                        moment *= (
                            share
                            * scalar(ni, w, rod, Scalar.BENDING_STIFFNESS)
                            / (reach * stiffness[0])
                        )
                    elif code == ParameterCode.INTERNAL_DAMPING:
                        carries = w[time_at(ni, rod, step) + TimeRow.KEEPS_VELOCITY]
                        moment = (
                            (carries / h)
                            * stiffness
                            * (u - load3(w, effective + EffectiveBend.DAMPED_FROM))
                        )
                    elif code == ParameterCode.LENGTH:
                        moment = -per_length * (moment + stiffness * rest)
                    else:
                        for a in ti.static(range(3)):
                            moment[a] = 0.0
                            if code == ParameterCode.REST_CURVATURE_1 + a:
                                moment[a] = -share * stiffness[a] * reach
                    add_parameter_derivative(
                        ni, w, rod, p, 2 * j + 1, -(jacobian.transpose() @ moment)
                    )
                    add_parameter_derivative(ni, w, rod, p, 2 * j + 3, jacobian @ moment)
        air_drag_parameter_derivatives(ni, w, rod, step)
        if ni[Header.FRICTION_PAIRS] > 0:
            friction_parameter_derivatives(ni, w, rod, step)
        if ni[Header.LAYERS] > 0:
            plastic_parameter_derivatives(ni, w, rod, step)
    else:
        result = inertia_derivatives(ni, w, w33, task, rod, step, arg, real)
    return result
