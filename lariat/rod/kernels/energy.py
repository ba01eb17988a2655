"""Energy, gradient and Hessian of a step."""

import taichi as ti

from lariat.rod.kernels.access import (
    bend_turn,
    hessian_at,
    inertia_terms,
    orientation_at,
    position_at,
    scalar,
    step_times,
)
from lariat.rod.kernels.rotations import (
    add3,
    add33,
    cross_matrix,
    load3,
    load4,
    rotation_matrix,
    store3,
    store33,
)
from lariat.rod.kernels.signed_distance import contacts
from lariat.rod.kernels.types import Doubles, Integers
from lariat.rod.launch.codes import Task
from lariat.rod.launch.layout import EFFECTIVE_BEND_WIDTH, HISTORY_SLOTS, Header, Scalar, Section


@ti.real_func
def bends(
    ni: Integers, w: Doubles, task: ti.i32, rod: ti.i32, step: ti.i32, arg: ti.i32, real: ti.f64
) -> ti.f64:
    """Bending and twisting."""
    result = 0.0
    if task == Task.BEND_ENERGY:
        exact = arg
        n = ni[Header.NODES]
        g = rod + ni[Section.GRADIENT]
        energy = 0.0
        for j in range(n - 2):
            y, jacobian, c, d = bend_turn(ni, w, rod, step + HISTORY_SLOTS, j)
            stiffness = load3(w, rod + ni[Section.EFFECTIVE_BENDS] + EFFECTIVE_BEND_WIDTH * j)
            rest = load3(w, rod + ni[Section.EFFECTIVE_BENDS] + EFFECTIVE_BEND_WIDTH * j + 3)
            moment = stiffness * (y - rest)
            energy += 0.5 * moment.dot(y - rest)
            back = jacobian.transpose()
            add3(w, g + 6 * j + 3, -(back @ moment))
            add3(w, g + 6 * j + 9, jacobian @ moment)
            front = jacobian
            rear = back
            for a in ti.static(range(3)):
                for b in ti.static(range(3)):
                    front[a, b] *= stiffness[b]
                    rear[a, b] *= stiffness[b]
            if exact:
                ky = cross_matrix(y)
                km = cross_matrix(moment)
                twice = y.cross(moment)
                second = -c * (cross_matrix(twice) + ky @ km)
                second += d * (ky @ twice).outer_product(y)
                front += second + 0.5 * km
                rear += second - 0.5 * km
            low = rear @ jacobian
            high = front @ back
            m = hessian_at(ni, rod, step, 2 * j + 1)
            add33(w, m, 0.5 * (low + low.transpose()))
            add33(w, m + 54, 0.5 * (high + high.transpose()))
            add33(w, m + 18, -(front @ jacobian))
        result = energy
    else:
        result = contacts(ni, w, task, rod, step, arg, real)
    return result


@ti.real_func
def edges(
    ni: Integers, w: Doubles, task: ti.i32, rod: ti.i32, step: ti.i32, arg: ti.i32, real: ti.f64
) -> ti.f64:
    """Inertia, gravity and stretch; clears what the others add to."""
    result = 0.0
    if task == Task.EDGE_ENERGY:
        exact = arg
        shift = real
        n = ni[Header.NODES]
        _h, weight, _carry = step_times(ni, w, rod, step)
        stretch = scalar(ni, w, rod, Scalar.STRETCH_STIFFNESS)
        length = scalar(ni, w, rod, Scalar.EDGE_LENGTH)
        gravity = ti.Vector(
            [
                scalar(ni, w, rod, Scalar.GRAVITY_X),
                scalar(ni, w, rod, Scalar.GRAVITY_Y),
                scalar(ni, w, rod, Scalar.GRAVITY_Z),
            ]
        )
        zero = ti.Matrix.zero(ti.f64, 3, 3)
        eye = ti.Matrix.identity(ti.f64, 3)
        g = rod + ni[Section.GRADIENT]
        energy = 0.0
        for i in range(n):
            mass = w[rod + ni[Section.MASSES] + i]
            x = load3(w, position_at(ni, rod, step + HISTORY_SLOTS, i))
            away = x - load3(w, rod + ni[Section.TARGET_POSITIONS] + 3 * i)
            energy += mass * (0.5 * weight * away.dot(away) - gravity.dot(x))
            store3(w, g + 6 * i, mass * (weight * away - gravity))
            m = hessian_at(ni, rod, step, 2 * i)
            store33(w, m, (mass * weight + shift * stretch / length) * eye)
            store33(w, m + 9, zero)
            store33(w, m + 18, zero)
        for i in range(n - 1):
            q = load4(w, orientation_at(ni, rod, step + HISTORY_SLOTS, i))
            r = rotation_matrix(q)
            edge = load3(w, position_at(ni, rod, step + HISTORY_SLOTS, i + 1)) - load3(
                w, position_at(ni, rod, step + HISTORY_SLOTS, i)
            )
            strain = edge / length - ti.Vector([r[0, 2], r[1, 2], r[2, 2]])
            force = stretch * strain
            energy += 0.5 * length * force.dot(strain)
            local = r.transpose() @ force
            tension = r.transpose() @ load3(w, rod + ni[Section.TENSIONS] + 3 * i)
            if not exact:
                tension = ti.Vector([0.0, 0.0, ti.max(tension[2], 0.0)])
            add3(w, g + 6 * i, -force)
            add3(w, g + 6 * i + 6, force)
            # Rows: how the moment about d1, d2, d3 answers a change of the edge vector.
            lever = stretch * ti.Matrix(
                [[r[0, 1], r[1, 1], r[2, 1]], [-r[0, 0], -r[1, 0], -r[2, 0]], [0.0, 0.0, 0.0]]
            )
            m = hessian_at(ni, rod, step, 2 * i)
            for a in ti.static(range(3)):
                w[m + 4 * a] = w[m + 4 * a] + stretch / length
                w[m + 54 + 4 * a] = w[m + 54 + 4 * a] + stretch / length
                w[m + 18 + 4 * a] = w[m + 18 + 4 * a] - stretch / length
            add33(w, m + 9, -lever)
            turning = length * ti.Matrix(
                [
                    [stretch + tension[2], 0.0, -0.5 * tension[0]],
                    [0.0, stretch + tension[2], -0.5 * tension[1]],
                    [-0.5 * tension[0], -0.5 * tension[1], 0.0],
                ]
            )
            _re, im, inertia, turn = inertia_terms(
                ni, w, rod, weight, q, load4(w, rod + ni[Section.TARGET_ORIENTATIONS] + 4 * i)
            )
            momentum = 2.0 * inertia * im
            energy += momentum.dot(im)
            moment = turn.transpose() @ momentum
            store3(
                w,
                g + 6 * i + 3,
                moment + ti.Vector([length * local[1], -length * local[0], 0.0]),
            )
            scaled = turn
            for a in ti.static(range(3)):
                for b in ti.static(range(3)):
                    scaled[a, b] *= inertia[a]
            turning += turn.transpose() @ scaled
            lift = shift * stretch * length
            if exact:
                lift -= 0.5 * momentum.dot(im)
            store33(w, m + 27, turning + lift * eye)
            store33(w, m + 36, lever.transpose())
            store33(w, m + 45, zero)
        result = energy
    else:
        result = bends(ni, w, task, rod, step, arg, real)
    return result
