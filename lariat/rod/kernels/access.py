"""Where things lie, and short expressions of them; inlined, hence without branches."""

import taichi as ti

from lariat.rod.kernels.rotations import (
    cross_matrix,
    exponential,
    left_jacobian_inverse,
    load3,
    load4,
    log_coefficients,
    logarithm,
    quaternion_product,
    relative,
    rotation_matrix,
)
from lariat.rod.launch.codes import Derivatives
from lariat.rod.launch.layout import (
    HISTORY_SLOTS,
    STEP_BLOCKS,
    TIME_WIDTH,
    Header,
    Scalar,
    Section,
    TimeRow,
)


@ti.func
def position_at(ni: ti.template(), rod, slot, i):
    return rod + ni[Section.POSITIONS] + 3 * (slot * ni[Header.NODES] + i)


@ti.func
def orientation_at(ni: ti.template(), rod, slot, i):
    return rod + ni[Section.ORIENTATIONS] + 4 * (slot * (ni[Header.NODES] - 1) + i)


@ti.func
def hessian_at(ni: ti.template(), rod, step, block):
    kept = ti.select(ni[Header.DERIVATIVES] >= Derivatives.ADJOINT, step, 0)
    return rod + ni[Section.HESSIAN] + 27 * (kept * (2 * ni[Header.NODES] - 1) + block)


@ti.func
def scalar(ni: ti.template(), w: ti.template(), rod, k):
    return w[rod + ni[Section.SCALARS] + k]


@ti.func
def time_at(ni: ti.template(), rod, step):
    return rod + ni[Section.TIMES] + TIME_WIDTH * step


@ti.func
def step_times(ni: ti.template(), w: ti.template(), rod, step):
    """Duration, inertia weight (1 + c h) / h^2 and carried share of velocity."""
    h = w[time_at(ni, rod, step)]
    damped = 1.0 + scalar(ni, w, rod, Scalar.DAMPING) * h
    return h, damped / (h * h), 1.0 / damped


@ti.func
def target_share(ni: ti.template(), w: ti.template(), rod, step, back, carry):
    """Share of the solve `back` before this one in where inertia alone would lead."""
    start = time_at(ni, rod, step) + back - 1
    return w[start + TimeRow.BASE_SHARES] + carry * w[start + TimeRow.MOMENTUM_SHARES]


@ti.func
def grip(ni: ti.template(), w: ti.template(), rod, step, end):
    """Where a driven end stands after a step: outermost node, next node, edge orientation."""
    n = ni[Header.NODES]
    start = time_at(ni, rod, step)
    slot = step + HISTORY_SLOTS - ti.cast(w[start + TimeRow.GRIP_SOLVES_BACK], ti.i32)
    h = w[start + TimeRow.GRIP_DURATION]
    block = ni[STEP_BLOCKS + step // ni[Header.SUBSTEPS]]
    action = rod + ni[Section.ACTIONS] + 12 * block + 6 * end
    node = end * (n - 1)
    edge = end * (n - 2)
    outer = load3(w, position_at(ni, rod, slot, node)) + h * load3(w, action)
    q1 = load4(w, orientation_at(ni, rod, slot, edge))
    q = quaternion_product(exponential(h * load3(w, action + 3)), q1)
    q = q / ti.sqrt(q.dot(q))
    reach = scalar(ni, w, rod, Scalar.EDGE_LENGTH) * (1.0 - 2.0 * end)
    inner = outer + reach * (rotation_matrix(q) @ ti.Vector([0.0, 0.0, 1.0]))
    return outer, inner, q


@ti.func
def bend_turn(ni: ti.template(), w: ti.template(), rod, slot, j):
    """Rotation vector between edges j and j + 1, its J_l^-1, and c, c'/t of that."""
    u = relative(
        load4(w, orientation_at(ni, rod, slot, j)),
        load4(w, orientation_at(ni, rod, slot, j + 1)),
    )
    y = logarithm(u)
    c, d = log_coefficients(u)
    return y, left_jacobian_inverse(y, c), c, d


@ti.func
def internal_rate(ni: ti.template(), w: ti.template(), rod, step):
    """Internal damping over the duration of a step [-]; none where velocity is forgotten."""
    start = time_at(ni, rod, step)
    return (
        scalar(ni, w, rod, Scalar.INTERNAL_DAMPING) * w[start + TimeRow.KEEPS_VELOCITY] / w[start]
    )


@ti.func
def inertia_terms(ni: ti.template(), w: ti.template(), rod, weight, q, target):
    """Im and Re of conj(target) q, the momentum p, and W with gradient W^T p (body frame)."""
    u = relative(target, q)
    v = ti.Vector([u[1], u[2], u[3]])
    bend = weight * scalar(ni, w, rod, Scalar.BENDING_INERTIA)
    twist = weight * scalar(ni, w, rod, Scalar.TWISTING_INERTIA)
    inertia = ti.Vector([bend, bend, twist])
    turn = cross_matrix(v)
    for a in ti.static(range(3)):
        turn[a, a] += u[0]
    return u[0], v, inertia, turn


@ti.func
def past_turn(ni: ti.template(), w: ti.template(), rod, step, i, back):
    """Edge i some solves before, seen from the last one, as a unit quaternion."""
    return relative(
        load4(w, orientation_at(ni, rod, step + HISTORY_SLOTS - 1, i)),
        load4(w, orientation_at(ni, rod, step + HISTORY_SLOTS - back, i)),
    )


@ti.func
def inertia_coupling(ni: ti.template(), w: ti.template(), rod, step, i):
    """How the gradient at edge i answers turns of its orientation target."""
    _h, weight, _carry = step_times(ni, w, rod, step)
    _re, im, inertia, turn = inertia_terms(
        ni,
        w,
        rod,
        weight,
        load4(w, orientation_at(ni, rod, step + HISTORY_SLOTS, i)),
        load4(w, rod + ni[Section.TARGET_ORIENTATIONS] + 4 * i),
    )
    momentum = 2.0 * inertia * im
    answer = cross_matrix(momentum)
    for a in ti.static(range(3)):
        for b in ti.static(range(3)):
            answer[a, b] += 2.0 * turn[b, a] * inertia[b]
    return 0.5 * (momentum.outer_product(im) - answer @ turn.transpose())
