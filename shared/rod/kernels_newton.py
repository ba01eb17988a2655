# type: ignore
"""One implicit step: the minimiser of the rod's incremental energy, by Newton's method.

The energy of a step of length h from (x1, q1) with the step before that at (x0, q0) is

    sum over nodes    m wt |x - y|^2 / 2 - m g x
    sum over edges    l K |e / l - d3|^2 / 2                                    (eq. 4)
                      + wt J |2 Im(conj(q^) q)|^2 / 2
    sum over bends    (k1, k2, k3) |log(conj(q_i) q_i+1) - rest|^2 / 2           (eq. 7)
    contact           l p(distance - radius), at evenly spaced samples of every edge

with wt = (1 + c h) / h^2, y = x1 + carry (x1 - x0) and q^ likewise, carry = 1 / (1 + c h): the
damping c only rescales inertia. Shear is as stiff as stretch, as in the paper, whose curvature
2 Im(conj(q) q) is replaced by the logarithm, so that torque stays proportional to twist.

Stretch is far stiffer than all else and makes plain Newton crawl. Its force is therefore a
variable of its own (mixed Newton): the geometric part of the Hessian takes the force that the
last linear solve predicted, and the number of iterations does not depend on the stiffness.
"""

import taichi as ti

from shared.rod import layout as at
from shared.rod.kernels_contact import signed_distance
from shared.rod.kernels_math import (
    add3,
    add33,
    cross_matrix,
    exponential,
    left_jacobian_inverse,
    load3,
    load4,
    load33,
    log_coefficients,
    logarithm,
    quaternion_product,
    relative,
    rotation_matrix,
    store3,
    store4,
    store33,
    turned,
)
from shared.rod.kernels_types import Doubles, Integers


@ti.func
def position_at(ni: ti.template(), rod, slot, i):
    return rod + ni[at.AT_POSITIONS] + 3 * (slot * ni[at.NODES] + i)


@ti.func
def orientation_at(ni: ti.template(), rod, slot, i):
    return rod + ni[at.AT_ORIENTATIONS] + 4 * (slot * (ni[at.NODES] - 1) + i)


@ti.func
def hessian_at(ni: ti.template(), rod, step, block):
    kept = ti.select(ni[at.WANT] > 0, step, 0)
    return rod + ni[at.AT_HESSIAN] + 27 * (kept * (2 * ni[at.NODES] - 1) + block)


@ti.func
def scalar(ni: ti.template(), w: ti.template(), rod, k):
    return w[rod + ni[at.AT_SCALARS] + k]


@ti.func
def step_times(ni: ti.template(), w: ti.template(), rod, step):
    """Duration, inertia weight (1 + c h) / h^2 and carried share of velocity."""
    h = w[rod + ni[at.AT_TIMES] + 2 * step]
    damped = 1.0 + scalar(ni, w, rod, at.DAMPING) * h
    return h, damped / (h * h), w[rod + ni[at.AT_TIMES] + 2 * step + 1] / damped


@ti.real_func
def predict(ni: Integers, w: Doubles, rod: ti.i32, step: ti.i32):
    """Inertial targets, and the start of the iteration: everything where it was."""
    n = ni[at.NODES]
    _h, _weight, carry = step_times(ni, w, rod, step)
    stretch = scalar(ni, w, rod, at.STRETCH)
    length = scalar(ni, w, rod, at.EDGE_LENGTH)
    for i in range(n):
        x0 = load3(w, position_at(ni, rod, step, i))
        x1 = load3(w, position_at(ni, rod, step + 1, i))
        store3(w, rod + ni[at.AT_TARGETS] + 3 * i, x1 + carry * (x1 - x0))
        store3(w, position_at(ni, rod, step + 2, i), x1)
    for i in range(n - 1):
        q0 = load4(w, orientation_at(ni, rod, step, i))
        q1 = load4(w, orientation_at(ni, rod, step + 1, i))
        turn = exponential(carry * logarithm(relative(q0, q1)))
        store4(w, rod + ni[at.AT_TARGET_ORIENTATIONS] + 4 * i, quaternion_product(q1, turn))
        store4(w, orientation_at(ni, rod, step + 2, i), q1)
        edge = load3(w, position_at(ni, rod, step + 1, i + 1)) - load3(
            w, position_at(ni, rod, step + 1, i)
        )
        d3 = rotation_matrix(q1) @ ti.Vector([0.0, 0.0, 1.0])
        store3(w, rod + ni[at.AT_TENSIONS] + 3 * i, stretch * (edge / length - d3))


@ti.func
def grip(ni: ti.template(), w: ti.template(), rod, step, end):
    """Where a driven end stands after a step: outermost node, next node, edge orientation."""
    n = ni[at.NODES]
    h, _weight, _carry = step_times(ni, w, rod, step)
    block = ni[at.INTEGERS + step // ni[at.SUBSTEPS]]
    action = rod + ni[at.AT_ACTIONS] + 12 * block + 6 * end
    node = end * (n - 1)
    edge = end * (n - 2)
    outer = load3(w, position_at(ni, rod, step + 1, node)) + h * load3(w, action)
    q1 = load4(w, orientation_at(ni, rod, step + 1, edge))
    q = quaternion_product(exponential(h * load3(w, action + 3)), q1)
    q = q / ti.sqrt(q.dot(q))
    reach = scalar(ni, w, rod, at.EDGE_LENGTH) * (1.0 - 2.0 * end)
    inner = outer + reach * (rotation_matrix(q) @ ti.Vector([0.0, 0.0, 1.0]))
    return outer, inner, q


@ti.real_func
def move_grips(ni: Integers, w: Doubles, rod: ti.i32, step: ti.i32, exactly: ti.i32):
    """Put driven ends where they belong (`exactly`), or write their way there as a step."""
    n = ni[at.NODES]
    d = rod + ni[at.AT_STEP]
    for end in range(2):
        kind = ni[at.LEFT + end]
        if kind != at.FREE:
            outer, inner, q = grip(ni, w, rod, step, end)
            node = end * (n - 1)
            if exactly:
                store3(w, position_at(ni, rod, step + 2, node), outer)
            else:
                x1 = load3(w, position_at(ni, rod, step + 1, node))
                store3(w, d + 6 * node, outer - x1)
            if kind == at.CLAMPED:
                node = 1 + end * (n - 3)
                edge = end * (n - 2)
                if exactly:
                    store3(w, position_at(ni, rod, step + 2, node), inner)
                    store4(w, orientation_at(ni, rod, step + 2, edge), q)
                else:
                    x1 = load3(w, position_at(ni, rod, step + 1, node))
                    q1 = load4(w, orientation_at(ni, rod, step + 1, edge))
                    store3(w, d + 6 * node, inner - x1)
                    store3(w, d + 6 * edge + 3, logarithm(relative(q1, q)))


@ti.func
def contact_law(ni: ti.template(), w: ti.template(), rod, depth):
    """Energy, force and stiffness of a penalty that is smooth at first touch."""
    stiffness = scalar(ni, w, rod, at.CONTACT_STIFFNESS)
    margin = scalar(ni, w, rod, at.CONTACT_MARGIN)
    rest = depth - margin
    soft = depth < margin
    energy = ti.select(
        soft,
        depth * depth * depth / (6.0 * margin),
        0.5 * rest * rest + 0.5 * margin * rest + margin * margin / 6.0,
    )
    force = ti.select(soft, depth * depth / (2.0 * margin), depth - 0.5 * margin)
    slope = ti.select(soft, depth / margin, 1.0)
    return stiffness * energy, stiffness * force, stiffness * slope


@ti.real_func
def assemble_contact(ni: Integers, w: Doubles, rod: ti.i32, step: ti.i32, exact: ti.i32) -> ti.f64:
    n = ni[at.NODES]
    samples = ni[at.SAMPLES]
    length = scalar(ni, w, rod, at.EDGE_LENGTH)
    reach = scalar(ni, w, rod, at.CONTACT_REACH)
    share = length / samples
    total = 0.0
    for k in range(ni[at.OBSTACLES]):
        row = ni[at.AT_OBSTACLES] + at.OBSTACLE_WIDTH * k
        for i in range(n - 1):
            a = load3(w, position_at(ni, rod, step + 2, i))
            b = load3(w, position_at(ni, rod, step + 2, i + 1))
            # Reach of the whole edge, which may be stretched while the iteration runs.
            bound = 0.5 * (b - a).norm() + reach
            middle = 0.5 * (a + b)
            near = (middle - load3(w, row + 1)).norm() < w[row + 16] + bound
            if near:
                gap, _normal, _bend = signed_distance(w, row, middle)
                near = gap < bound
            if near:
                for j in range(samples):
                    s = (j + 0.5) / samples
                    gap, normal, bend = signed_distance(w, row, a + s * (b - a))
                    depth = reach - gap
                    if depth > 0.0:
                        energy, force, slope = contact_law(ni, w, rod, depth)
                        total += share * energy
                        pull = -share * force * normal
                        stiff = share * slope * normal.outer_product(normal)
                        if exact:
                            stiff -= share * force * bend
                        g = rod + ni[at.AT_GRADIENT] + 6 * i
                        add3(w, g, (1.0 - s) * pull)
                        add3(w, g + 6, s * pull)
                        m = hessian_at(ni, rod, step, 2 * i)
                        add33(w, m, ((1.0 - s) * (1.0 - s)) * stiff)
                        add33(w, m + 18, (s * (1.0 - s)) * stiff)
                        add33(w, m + 54, (s * s) * stiff)
    return total


@ti.func
def bend_terms(ni: ti.template(), w: ti.template(), rod, slot, j):
    """Rotation between edges j and j + 1, moment, J_l^-1, and the bend's stiffnesses."""
    y = logarithm(
        relative(
            load4(w, orientation_at(ni, rod, slot, j)),
            load4(w, orientation_at(ni, rod, slot, j + 1)),
        )
    )
    bend = rod + ni[at.AT_BENDS] + 6 * j
    stiffness = load3(w, bend)
    return y, stiffness * (y - load3(w, bend + 3)), left_jacobian_inverse(y), stiffness


@ti.func
def inertia_terms(ni: ti.template(), w: ti.template(), rod, weight, q, target):
    """Im and Re of conj(target) q, the momentum p, and W with gradient W^T p (body frame)."""
    u = relative(target, q)
    v = ti.Vector([u[1], u[2], u[3]])
    bend = weight * scalar(ni, w, rod, at.INERTIA_BEND)
    twist = weight * scalar(ni, w, rod, at.INERTIA_TWIST)
    inertia = ti.Vector([bend, bend, twist])
    turn = cross_matrix(v)
    for a in ti.static(range(3)):
        turn[a, a] += u[0]
    return u[0], v, inertia, turn


@ti.real_func
def assemble(
    ni: Integers, w: Doubles, rod: ti.i32, step: ti.i32, exact: ti.i32, shift: ti.f64
) -> ti.f64:
    """Energy, gradient and Hessian of the step at its current iterate.

    With `exact` 0 all second variations that could make the Hessian indefinite are left out.
    `shift` adds a multiple of the stretch stiffness to the diagonal.
    """
    n = ni[at.NODES]
    _h, weight, _carry = step_times(ni, w, rod, step)
    stretch = scalar(ni, w, rod, at.STRETCH)
    length = scalar(ni, w, rod, at.EDGE_LENGTH)
    gravity = ti.Vector(
        [
            scalar(ni, w, rod, at.GRAVITY_X),
            scalar(ni, w, rod, at.GRAVITY_Y),
            scalar(ni, w, rod, at.GRAVITY_Z),
        ]
    )
    zero = ti.Matrix.zero(ti.f64, 3, 3)
    eye = ti.Matrix.identity(ti.f64, 3)
    g = rod + ni[at.AT_GRADIENT]
    energy = 0.0
    for i in range(n):
        mass = w[rod + ni[at.AT_MASSES] + i]
        x = load3(w, position_at(ni, rod, step + 2, i))
        away = x - load3(w, rod + ni[at.AT_TARGETS] + 3 * i)
        energy += mass * (0.5 * weight * away.dot(away) - gravity.dot(x))
        store3(w, g + 6 * i, mass * (weight * away - gravity))
        m = hessian_at(ni, rod, step, 2 * i)
        store33(w, m, (mass * weight + shift * stretch / length) * eye)
        store33(w, m + 9, zero)
        store33(w, m + 18, zero)
    for i in range(n - 1):
        q = load4(w, orientation_at(ni, rod, step + 2, i))
        r = rotation_matrix(q)
        edge = load3(w, position_at(ni, rod, step + 2, i + 1)) - load3(
            w, position_at(ni, rod, step + 2, i)
        )
        strain = edge / length - ti.Vector([r[0, 2], r[1, 2], r[2, 2]])
        force = stretch * strain
        energy += 0.5 * length * force.dot(strain)
        local = r.transpose() @ force
        tension = r.transpose() @ load3(w, rod + ni[at.AT_TENSIONS] + 3 * i)
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
            w[m + 4 * a] += stretch / length
            w[m + 54 + 4 * a] += stretch / length
            w[m + 18 + 4 * a] -= stretch / length
        add33(w, m + 9, -lever)
        turning = length * ti.Matrix(
            [
                [stretch + tension[2], 0.0, -0.5 * tension[0]],
                [0.0, stretch + tension[2], -0.5 * tension[1]],
                [-0.5 * tension[0], -0.5 * tension[1], 0.0],
            ]
        )
        _re, im, inertia, turn = inertia_terms(
            ni, w, rod, weight, q, load4(w, rod + ni[at.AT_TARGET_ORIENTATIONS] + 4 * i)
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
    for j in range(n - 2):
        y, moment, jacobian, stiffness = bend_terms(ni, w, rod, step + 2, j)
        rest = load3(w, rod + ni[at.AT_BENDS] + 6 * j + 3)
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
            c, d = log_coefficients(y.dot(y))
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
    return energy + assemble_contact(ni, w, rod, step, exact)


@ti.real_func
def factor(ni: Integers, w: Doubles, rod: ti.i32, step: ti.i32) -> ti.i32:
    """Block LDL^T in place, over free blocks; returns whether all pivots are positive."""
    first = ni[at.FIRST_FREE]
    end = ni[at.END_FREE]
    definite = 1
    for j in range(first, end):
        m = hessian_at(ni, rod, step, j)
        d = load33(w, m)
        minor = d[0, 0] * d[1, 1] - d[0, 1] * d[0, 1]
        determinant = d.determinant()
        if d[0, 0] <= 0.0 or minor <= 0.0 or determinant <= 0.0:
            definite = 0
        inverse = ti.Matrix.zero(ti.f64, 3, 3)
        if ti.abs(determinant) > 0.0:
            inverse = d.inverse()
        store33(w, m, inverse)
        if j + 1 < end:
            near = load33(w, m + 9)
            near_factor = near @ inverse
            add33(w, m + 27, -(near_factor @ near.transpose()))
            if j + 2 < end:
                far = load33(w, m + 18)
                far_factor = far @ inverse
                add33(w, m + 36, -(far @ near_factor.transpose()))
                add33(w, m + 54, -(far_factor @ far.transpose()))
                store33(w, m + 18, far_factor)
            store33(w, m + 9, near_factor)
    return definite


@ti.real_func
def solve(ni: Integers, w: Doubles, rod: ti.i32, step: ti.i32, d: ti.i32):
    """H v = b for vector `d` in place, free blocks only."""
    first = ni[at.FIRST_FREE]
    end = ni[at.END_FREE]
    for j in range(first, end):
        m = hessian_at(ni, rod, step, j)
        v = load3(w, d + 3 * j)
        if j + 1 < end:
            add3(w, d + 3 * j + 3, -(load33(w, m + 9) @ v))
        if j + 2 < end:
            add3(w, d + 3 * j + 6, -(load33(w, m + 18) @ v))
    for back in range(end - first):
        j = end - 1 - back
        m = hessian_at(ni, rod, step, j)
        v = load33(w, m) @ load3(w, d + 3 * j)
        if j + 1 < end:
            v -= load33(w, m + 9).transpose() @ load3(w, d + 3 * j + 3)
        if j + 2 < end:
            v -= load33(w, m + 18).transpose() @ load3(w, d + 3 * j + 6)
        store3(w, d + 3 * j, v)


@ti.real_func
def subtract_couplings(ni: Integers, w: Doubles, rod: ti.i32, step: ti.i32, d: ti.i32):
    """Take from the free blocks of `d` what the steps of the fixed blocks cause there."""
    first = ni[at.FIRST_FREE]
    end = ni[at.END_FREE]
    count = 2 * ni[at.NODES] - 1
    for j in range(ti.max(first - 2, 0), first):
        v = load3(w, d + 3 * j)
        for k in range(2):
            to = j + 1 + k
            if to >= first and to < end:
                m = hessian_at(ni, rod, step, j) + 9 + 9 * k
                add3(w, d + 3 * to, -(load33(w, m) @ v))
    for j in range(ti.max(end - 2, first), end):
        for k in range(2):
            to = j + 1 + k
            if to >= end and to < count:
                m = hessian_at(ni, rod, step, j) + 9 + 9 * k
                add3(w, d + 3 * j, -(load33(w, m).transpose() @ load3(w, d + 3 * to)))


@ti.real_func
def apply_step(ni: Integers, w: Doubles, rod: ti.i32, step: ti.i32, share: ti.f64):
    """Move the iterate to accepted + share * step; the tensions follow linearly."""
    n = ni[at.NODES]
    d = rod + ni[at.AT_STEP]
    stretch = scalar(ni, w, rod, at.STRETCH)
    length = scalar(ni, w, rod, at.EDGE_LENGTH)
    for i in range(n - 1):
        x = load3(w, rod + ni[at.AT_ACCEPTED] + 3 * i)
        nearby = load3(w, rod + ni[at.AT_ACCEPTED] + 3 * i + 3)
        q = load4(w, rod + ni[at.AT_ACCEPTED_ORIENTATIONS] + 4 * i)
        r = rotation_matrix(q)
        phi = share * load3(w, d + 6 * i + 3)
        edge = nearby - x + share * (load3(w, d + 6 * i + 6) - load3(w, d + 6 * i))
        d3 = r @ ti.Vector([phi[1], -phi[0], 1.0])
        store3(w, rod + ni[at.AT_TENSIONS] + 3 * i, stretch * (edge / length - d3))
        store3(w, position_at(ni, rod, step + 2, i), x + share * load3(w, d + 6 * i))
        store4(w, orientation_at(ni, rod, step + 2, i), turned(q, phi))
    x = load3(w, rod + ni[at.AT_ACCEPTED] + 3 * n - 3)
    store3(w, position_at(ni, rod, step + 2, n - 1), x + share * load3(w, d + 6 * n - 6))


@ti.real_func
def accept(ni: Integers, w: Doubles, rod: ti.i32, step: ti.i32):
    """Keep the iterate as the point to step from."""
    n = ni[at.NODES]
    for k in range(3 * n):
        w[rod + ni[at.AT_ACCEPTED] + k] = w[position_at(ni, rod, step + 2, 0) + k]
    for k in range(4 * (n - 1)):
        w[rod + ni[at.AT_ACCEPTED_ORIENTATIONS] + k] = w[orientation_at(ni, rod, step + 2, 0) + k]


@ti.real_func
def descend(ni: Integers, w: Doubles, rod: ti.i32, step: ti.i32):
    """Solve one step, from the last one's end; writes the report of the step.

    First plain Newton steps: the fastest, and nearly always enough. Where these run astray, it
    starts again from the last step's end, with line search on the energy and definite Hessians.
    """
    n = ni[at.NODES]
    count = 2 * n - 1
    first = ni[at.FIRST_FREE]
    end = ni[at.END_FREE]
    length = scalar(ni, w, rod, at.EDGE_LENGTH)
    tolerance = scalar(ni, w, rod, at.TOLERANCE)
    d = rod + ni[at.AT_STEP]
    g = rod + ni[at.AT_GRADIENT]
    predict(ni, w, rod, step)
    iterations = 0
    attempts = 0
    exact = 1
    shift = 0.0
    share = 1.0
    lowest = 1e300
    careful = 0
    finishing = 0
    converged = 0
    definite = 1
    largest = 0.0
    running = 1
    while running == 1:
        energy = assemble(ni, w, rod, step, exact, shift)
        attempts += 1
        if careful == 1 and finishing == 0 and not (energy <= lowest):
            share *= 0.5
            if share < 1e-6:
                # No descent left above rounding: this is as far as it goes.
                running = 0
                apply_step(ni, w, rod, step, 0.0)
            else:
                apply_step(ni, w, rod, step, share)
        else:
            definite = factor(ni, w, rod, step)
            if finishing == 1:
                running = 0
            elif definite == 0 and exact == 1:
                exact = 0
                if careful == 1:
                    lowest = energy
            elif definite == 0:
                shift = ti.max(10.0 * shift, 1e-9)
            else:
                if careful == 1:
                    lowest = energy
                accept(ni, w, rod, step)
                for j in range(count):
                    fixed = j < first or j >= end
                    for a in ti.static(range(3)):
                        w[d + 3 * j + a] = 0.0 if fixed else -w[g + 3 * j + a]
                if iterations == 0:
                    move_grips(ni, w, rod, step, 0)
                    subtract_couplings(ni, w, rod, step, d)
                solve(ni, w, rod, step, d)
                moved = 0.0
                rotated = 0.0
                for i in range(n):
                    moved = ti.max(moved, load3(w, d + 6 * i).norm())
                    if i < n - 1:
                        rotated = ti.max(rotated, load3(w, d + 6 * i + 3).norm())
                largest = ti.max(moved, length * rotated)
                share = 1.0
                if iterations > 0:
                    share = ti.min(
                        1.0, ti.min(2.0 * length / (moved + 1e-30), 0.8 / (rotated + 1e-30))
                    )
                apply_step(ni, w, rod, step, share)
                if iterations == 0:
                    move_grips(ni, w, rod, step, 1)
                if iterations > 0 and largest < tolerance:
                    converged = 1
                    running = 0
                    if exact == 0 or shift > 0.0:
                        # Derivatives want the true Hessian.
                        running = 1
                        finishing = 1
                iterations += 1
                exact = 1
                shift = 0.0
        if running == 1 and finishing == 0:
            astray = careful == 0 and (iterations >= 14 or not (largest < 1e6))
            if astray:
                careful = 1
                predict(ni, w, rod, step)
                move_grips(ni, w, rod, step, 1)
                iterations = 1
                exact = 1
                shift = 0.0
            elif attempts >= ni[at.MAX_ITERATIONS]:
                running = 0
    report = rod + ni[at.AT_REPORT] + at.REPORT_WIDTH * step
    w[report] = attempts
    w[report + 1] = converged
    w[report + 2] = largest
    w[report + 3] = definite
