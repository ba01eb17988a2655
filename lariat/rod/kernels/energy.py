"""Inertia, weight, stretch and bending, with the drag of the air: energy, gradient and Hessian.

With the inertial targets y and q^ of `prediction`, wt = (1 + c h) / h^2, nodes of mass m, edges of
length l and moments of inertia J:

    (I)  sum over nodes  m wt |x - y|^2 / 2
         sum over edges  wt J |2 Im(conj(q^) q)|^2 / 2
    (W)  sum over nodes  -m g x
    (S)  sum over edges  l K |e / l - d3|^2 / 2                   e = x_i+1 - x_i, d3 = R(q_i) z
    (B)  sum over bends  (k1, k2, k3) |u - rest|^2 / 2            u = log(conj(q_i) q_i+1)
         less what layers that yield leave out                    see `plasticity`

(S) is eq. (4) of Ying & Yamazaki (2024) with shear as stiff as stretch, (B) their eq. (7) with the
logarithm instead of 2 Im(conj(q) q), so that the torque stays proportional to twist. Rotations of
an edge are tangent vectors phi in its own frame, q exp(phi).

Stretch is far stiffer than all else and makes plain Newton iterations crawl. Its force is therefore
a variable of its own (mixed Newton): the geometric part of its Hessian takes the tension that the
last linear solve predicted, and the number of iterations does not depend on the stiffness.
"""

from lariat.kernel_cache.language import ti
from lariat.rod.kernels.addressing import (
    effective_bend_at,
    hessian_index,
    orientation_at,
    position_at,
    scalar,
    target_orientation_at,
    target_position_at,
)
from lariat.rod.kernels.air_drag import air_drag_energy, has_air_drag
from lariat.rod.kernels.memory import (
    add,
    bounded,
    bounded_index,
    lane_count,
    load3,
    load4,
    load_lane3,
    load_lane4,
    load_lane33,
    load_lane_symmetric,
    store,
    store_lane,
    store_lane33,
    store_lane_symmetric,
)
from lariat.rod.kernels.obstacle_contact import obstacle_contacts
from lariat.rod.kernels.plasticity import plastic_energy, update_sets
from lariat.rod.kernels.rotations import (
    left_jacobian_inverse,
    log_coefficients,
    logarithm,
    relative_rotation,
    rotation_matrix,
)
from lariat.rod.kernels.step_terms import (
    moment_curvature,
    step_times,
    turn_from_target,
    weighted_inertia,
)
from lariat.rod.kernels.types import Doubles, Integers, Matrices33
from lariat.rod.launch.codes import HessianPart, Task
from lariat.rod.launch.layout import (
    BEND_LANE_ROTATION,
    EFFECTIVE_BEND_WIDTH,
    HISTORY_SLOTS,
    LANE_COUNT,
    LANE_STRIDE,
    EffectiveBend,
    Header,
    Scalar,
    Section,
)


@ti.func
def scaled_identity(s):
    """s I, 3x3, without products with zeros."""
    return ti.Matrix([[s, 0.0, 0.0], [0.0, s, 0.0], [0.0, 0.0, s]])


@ti.real_func
def edge_energy(
    ni: Integers,
    w: Doubles,
    w33: Matrices33,
    task: ti.i32,
    rod: ti.i32,
    step: ti.i32,
    arg: ti.i32,
    real: ti.f64,
) -> ti.f64:
    """Set energy, gradient and Hessian to those of inertia, weight and stretch, eqs. (I), (W), (S).

    Args:
        arg: `HessianPart` to set.
        real: Levenberg shift on the Hessian's diagonal, relative to the stretch stiffness.
    """
    result = 0.0
    if task == Task.EDGE_ENERGY:
        with_hessian = arg != HessianPart.NONE
        exact = arg != HessianPart.POSITIVE
        shift = real
        n = ni[Header.NODES]
        _h, weight, _carry = step_times(ni, w, rod, step)
        stretch = scalar(ni, w, rod, Scalar.STRETCH_STIFFNESS)
        length = scalar(ni, w, rod, Scalar.EDGE_LENGTH)
        per_length = 1.0 / length
        gravity = ti.Vector(
            [
                scalar(ni, w, rod, Scalar.GRAVITY_X),
                scalar(ni, w, rod, Scalar.GRAVITY_Y),
                scalar(ni, w, rod, Scalar.GRAVITY_Z),
            ]
        )
        zero = ti.Matrix.zero(ti.f64, 3, 3)
        curved = ti.select(exact, 0.5, 0.0)
        slot = step + HISTORY_SLOTS
        h = hessian_index(ni, rod, step)
        # Offsets are computed before the loops, which would read the sizes again after every store.
        g = rod + ni[Section.GRADIENT]
        masses = bounded(rod + ni[Section.MASSES])
        positions = position_at(ni, rod, slot, 0)
        orientations = orientation_at(ni, rod, slot, 0)
        target_positions = target_position_at(ni, rod, step, 0)
        target_orientations = target_orientation_at(ni, rod, step, 0)
        tensions = rod + ni[Section.TENSIONS]
        first_edge = ni[Header.FIRST_EDGE]
        end_edge = ni[Header.END_EDGE]
        energy = 0.0
        for i in range(n):
            mass = w[masses + i]
            x = load3(w, positions + 3 * i)
            displacement = x - load3(w, target_positions + 3 * i)
            energy += mass * (0.5 * weight * displacement.dot(displacement) - gravity.dot(x))
            store(w, g + 6 * i, mass * (weight * displacement - gravity))
            has_edge = i >= first_edge and i < end_edge
            follows_edge = i > first_edge and i <= end_edge
            beside = ti.select(has_edge, 1.0, 0.0) + ti.select(follows_edge, 1.0, 0.0)
            if not has_edge and i < n - 1:
                # The grip edge of a clamp: only a bend adds to its blocks.
                store(w, g + 6 * i + 3, ti.Vector([0.0, 0.0, 0.0]))
            if with_hessian:
                m = bounded_index(h + 6 * i)
                w33[m] = scaled_identity(mass * weight + (shift + beside) * stretch * per_length)
                if not has_edge:
                    for k in range(1, ti.select(i < n - 1, 6, 3)):
                        w33[m + k] = zero
        lanes = bounded(rod + ni[Section.LANES])
        inertia = weighted_inertia(ni, w, rod, weight)
        predicted = arg != HessianPart.TRUE
        for strip in range((end_edge - first_edge + LANE_COUNT - 1) // LANE_COUNT):
            first = first_edge + LANE_COUNT * strip
            count = ti.min(LANE_COUNT, end_edge - first)
            for k in range(count):
                i = first + k
                store_lane(w, lanes + k, 0, load3(w, positions + 3 * i))
                store_lane(w, lanes + k, 3, load4(w, orientations + 4 * i))
                store_lane(w, lanes + k, 7, load4(w, target_orientations + 4 * i))
                store_lane(w, lanes + k, 11, load3(w, tensions + 3 * i))
            store_lane(w, lanes + count, 0, load3(w, positions + 3 * (first + count)))
            for k in range(lane_count(count)):
                at = lanes + k
                r = rotation_matrix(load_lane4(w, at, 3))
                edge = load_lane3(w, at + 1, 0) - load_lane3(w, at, 0)
                strain = per_length * edge - ti.Vector([r[0, 2], r[1, 2], r[2, 2]])
                force = stretch * strain
                local = r.transpose() @ force
                im, momentum_map = turn_from_target(load_lane4(w, at, 3), load_lane4(w, at, 7))
                momentum = 2.0 * inertia * im
                spin = momentum.dot(im)
                w[at + LANE_STRIDE * 14] = 0.5 * length * force.dot(strain) + spin
                store_lane(w, at, 15, force)
                moment = momentum_map.transpose() @ momentum
                store_lane(
                    w, at, 18, moment + ti.Vector([length * local[1], -length * local[0], 0.0])
                )
                tension = r.transpose() @ load_lane3(w, at, 11)
                for a in ti.static(range(3)):
                    tension[a] = ti.select(predicted, tension[a], local[a])
                    pull = ti.max(tension[a], 0.0) if ti.static(a == 2) else 0.0
                    tension[a] = ti.select(exact, tension[a], pull)
                # Derivative of the moments about d1 and d2 with respect to the edge vector.
                store_lane(w, at, 21, stretch * ti.Vector([r[0, 1], r[1, 1], r[2, 1]]))
                store_lane(w, at, 24, -stretch * ti.Vector([r[0, 0], r[1, 0], r[2, 0]]))
                rotation_block = length * ti.Matrix(
                    [
                        [stretch + tension[2], 0.0, -0.5 * tension[0]],
                        [0.0, stretch + tension[2], -0.5 * tension[1]],
                        [-0.5 * tension[0], -0.5 * tension[1], 0.0],
                    ]
                )
                weighted_map = momentum_map
                for a in ti.static(range(3)):
                    for b in ti.static(range(3)):
                        weighted_map[a, b] *= inertia[a]
                rotation_block += momentum_map.transpose() @ weighted_map
                for a in ti.static(range(3)):
                    rotation_block[a, a] += shift * stretch * length - curved * spin
                store_lane_symmetric(w, at, 27, rotation_block)
            for k in range(count):
                i = first + k
                at = lanes + k
                energy += w[at + LANE_STRIDE * 14]
                force = load_lane3(w, at, 15)
                add(w, g + 6 * i, -force)
                add(w, g + 6 * i + 6, force)
                store(w, g + 6 * i + 3, load_lane3(w, at, 18))
                if with_hessian:
                    about1 = load_lane3(w, at, 21)
                    about2 = load_lane3(w, at, 24)
                    moment_arm = ti.Matrix.rows([about1, about2, [0.0, 0.0, 0.0]])
                    m = bounded_index(h + 6 * i)
                    w33[m + 1] = -moment_arm
                    w33[m + 2] = scaled_identity(-stretch * per_length)
                    w33[m + 3] = load_lane_symmetric(w, at, 27)
                    w33[m + 4] = moment_arm.transpose()
                    w33[m + 5] = zero
        result = energy
        if has_air_drag(ni, w, rod):
            result += air_drag_energy(ni, w, rod, step, arg)
    else:
        result = bend_energy(ni, w, w33, task, rod, step, arg, real)
    return result


@ti.real_func
def bend_energy(
    ni: Integers,
    w: Doubles,
    w33: Matrices33,
    task: ti.i32,
    rod: ti.i32,
    step: ti.i32,
    arg: ti.i32,
    real: ti.f64,
) -> ti.f64:
    """Add energy, gradient and Hessian of bending and twisting, eq. (B).

    Args:
        arg: `HessianPart` to add; the positive one is that of Gauss and Newton.
        real: One for the secant stiffness of layers, else zero.
    """
    result = 0.0
    if task == Task.BEND_ENERGY:
        exact = arg != HessianPart.POSITIVE
        n = ni[Header.NODES]
        g = rod + ni[Section.GRADIENT]
        h = hessian_index(ni, rod, step)
        energy = 0.0
        lanes = bounded(rod + ni[Section.LANES])
        orientations = orientation_at(ni, rod, step + HISTORY_SLOTS, 0)
        bends = effective_bend_at(ni, rod, step, 0)
        curved = ti.select(exact, 1.0, 0.0)
        for strip in range((n - 2 + LANE_COUNT - 1) // LANE_COUNT):
            first = LANE_COUNT * strip
            count = ti.min(LANE_COUNT, n - 2 - first)
            for k in range(count):
                effective = bends + EFFECTIVE_BEND_WIDTH * (first + k)
                q = load4(w, orientations + 4 * (first + k))
                store_lane(w, lanes + k, 0, q)
                store_lane(w, lanes + k, 4, load3(w, effective + EffectiveBend.STIFFNESS))
                store_lane(w, lanes + k, 7, load3(w, effective + EffectiveBend.REST))
            q = load4(w, orientations + 4 * (first + count))
            store_lane(w, lanes + count, 0, q)
            for k in range(lane_count(count)):
                at = lanes + k
                rotation = relative_rotation(load_lane4(w, at, 0), load_lane4(w, at + 1, 0))
                u = logarithm(rotation)
                c, d = log_coefficients(rotation)
                left_inverse = left_jacobian_inverse(u, c)
                stiffness = load_lane3(w, at, 4)
                bent = u - load_lane3(w, at, 7)
                moment = stiffness * bent
                right_inverse = left_inverse.transpose()
                w[at + LANE_STRIDE * 10] = 0.5 * moment.dot(bent)
                store_lane(w, at, 11, right_inverse @ moment)
                store_lane(w, at, 14, left_inverse @ moment)
                front_factor = left_inverse
                rear_factor = right_inverse
                for a in ti.static(range(3)):
                    for b in ti.static(range(3)):
                        front_factor[a, b] *= stiffness[b]
                        rear_factor[a, b] *= stiffness[b]
                curvature_term, moment_cross = moment_curvature(u, moment, c, d, curved)
                front_factor += curvature_term + moment_cross
                rear_factor += curvature_term - moment_cross
                store_lane_symmetric(w, at, 17, rear_factor @ left_inverse)
                store_lane_symmetric(w, at, 23, front_factor @ right_inverse)
                store_lane33(w, at, 29, -(front_factor @ left_inverse))
                store_lane(w, at, BEND_LANE_ROTATION, u)
            for k in range(count):
                j = first + k
                at = lanes + k
                energy += w[at + LANE_STRIDE * 10]
                add(w, g + 6 * j + 3, -load_lane3(w, at, 11))
                add(w, g + 6 * j + 9, load_lane3(w, at, 14))
                if arg != HessianPart.NONE:
                    m = bounded_index(h + 6 * j + 3)
                    w33[m] = w33[m] + load_lane_symmetric(w, at, 17)
                    w33[m + 6] = w33[m + 6] + load_lane_symmetric(w, at, 23)
                    w33[m + 2] = load_lane33(w, at, 29)
            if ni[Header.LAYERS] > 0:
                energy += plastic_energy(ni, w, rod, step, arg, real, first, count)
        result = energy
    else:
        if task == Task.UPDATE_STATE and ni[Header.LAYERS] > 0:
            update_sets(ni, w, rod, step)
        result = obstacle_contacts(ni, w, w33, task, rod, step, arg, real)
    return result
