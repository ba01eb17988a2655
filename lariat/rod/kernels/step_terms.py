"""Terms that several parts of a step share: time, grips, bends and rotational inertia.

They are inlined into real functions, and therefore have no branches.
"""

from lariat.kernel_cache.language import ti
from lariat.rod.kernels.addressing import (
    orientation_at,
    parameter_derivatives_at,
    position_at,
    scalar,
    target_orientation_at,
    time_at,
)
from lariat.rod.kernels.memory import load3, load4
from lariat.rod.kernels.rotations import (
    cross_matrix,
    exponential,
    left_jacobian_inverse,
    log_coefficients,
    logarithm,
    quaternion_product,
    relative_rotation,
)
from lariat.rod.launch.layout import (
    CLAMP_WEIGHTS,
    GROUP_COLUMNS,
    HISTORY_SLOTS,
    STEP_BLOCKS,
    Header,
    Scalar,
    Section,
    TimeRow,
)


@ti.func
def step_times(ni: ti.template(), w: ti.template(), rod, step):
    """Duration h, inertia weight (1 + c h) / h^2 and kept share of velocity 1 / (1 + c h)."""
    h = w[time_at(ni, rod, step)]
    damped = 1.0 + scalar(ni, w, rod, Scalar.DAMPING) * h
    return h, damped / (h * h), 1.0 / damped


@ti.func
def target_share(ni: ti.template(), w: ti.template(), rod, step, back, carry):
    """Share of the solve `back` before this one in the inertial target."""
    start = time_at(ni, rod, step) + back - 1
    return w[start + TimeRow.BASE_SHARES] + carry * w[start + TimeRow.MOMENTUM_SHARES]


@ti.func
def internal_rate(ni: ti.template(), w: ti.template(), rod, step):
    """Internal damping over the duration of a solve [-]; zero without velocity."""
    start = time_at(ni, rod, step)
    return (
        scalar(ni, w, rod, Scalar.INTERNAL_DAMPING) * w[start + TimeRow.KEEPS_VELOCITY] / w[start]
    )


@ti.func
def grip_target(ni: ti.template(), w: ti.template(), rod, step, end):
    """Pose of a driven end after a solve: position, and orientation of the outermost edge."""
    n = ni[Header.NODES]
    start = time_at(ni, rod, step)
    slot = step + HISTORY_SLOTS - ti.cast(w[start + TimeRow.GRIP_SOLVES_BACK], ti.i32)
    h = w[start + TimeRow.GRIP_DURATION]
    block = ni[STEP_BLOCKS + step // ni[Header.SUBSTEPS]]
    action = rod + ni[Section.ACTIONS] + 12 * block + 6 * end
    node = end * (n - 1)
    edge = end * (n - 2)
    position = load3(w, position_at(ni, rod, slot, node)) + h * load3(w, action)
    q1 = load4(w, orientation_at(ni, rod, slot, edge))
    q = quaternion_product(exponential(h * load3(w, action + 3)), q1)
    return position, q / ti.sqrt(q.dot(q))


@ti.func
def bend_share(j, count, left, right):
    """Length over which bend j of `count` acts, in edges; `left` and `right` count the clamps."""
    at_clamp = (left and j == 0) or (right and j == count - 1)
    beside = (left and j == 1) or (right and j == count - 2)
    return ti.select(at_clamp, CLAMP_WEIGHTS[0], ti.select(beside, CLAMP_WEIGHTS[1], 1.0))


@ti.func
def bend_rotation(ni: ti.template(), w: ti.template(), rod, slot, j):
    """Rotation vector between edges j and j + 1, its J_l^-1, and the coefficients c and c'/t."""
    u = relative_rotation(
        load4(w, orientation_at(ni, rod, slot, j)),
        load4(w, orientation_at(ni, rod, slot, j + 1)),
    )
    y = logarithm(u)
    c, d = log_coefficients(u)
    return y, left_jacobian_inverse(y, c), c, d


@ti.func
def moment_curvature(u, moment, c, d, curved):
    """Hessian of a bend through the curvature of u at a moment m, times `curved`, and [m]x / 2.

    -c ([u x m]x + [u]x [m]x) + d (u x (u x m)) u^T, in outer products.
    """
    u_moment = u.dot(moment)
    moment_cross = (0.5 * curved) * cross_matrix(moment)
    along = curved * (d * (u_moment * u - u.dot(u) * moment) - 2.0 * c * moment)
    curvature_term = (curved * c * u).outer_product(moment) + along.outer_product(u)
    for a in ti.static(range(3)):
        curvature_term[a, a] += curved * c * u_moment
    return curvature_term, moment_cross


@ti.func
def past_rotation(ni: ti.template(), w: ti.template(), rod, step, i, back):
    """Rotation of edge i from the last solve to the one `back` before this, as a quaternion."""
    return relative_rotation(
        load4(w, orientation_at(ni, rod, step + HISTORY_SLOTS - 1, i)),
        load4(w, orientation_at(ni, rod, step + HISTORY_SLOTS - back, i)),
    )


@ti.func
def weighted_inertia(ni: ti.template(), w: ti.template(), rod, weight):
    """Moments of inertia J of an edge about its axes, times `weight`."""
    bend = weight * scalar(ni, w, rod, Scalar.BENDING_INERTIA)
    return ti.Vector([bend, bend, weight * scalar(ni, w, rod, Scalar.TWISTING_INERTIA)])


@ti.func
def turn_from_target(q, target):
    """Im(u) of u = conj(target) q, and the matrix W = Re(u) I + [Im(u)]x.

    With weighted moments of inertia J, an edge's gradient in its frame is W^T 2 J Im(u).
    """
    u = relative_rotation(target, q)
    v = ti.Vector([u[1], u[2], u[3]])
    momentum_map = cross_matrix(v)
    for a in ti.static(range(3)):
        momentum_map[a, a] += u[0]
    return v, momentum_map


@ti.func
def inertia_coupling(ni: ti.template(), w: ti.template(), rod, step, i):
    """Derivative of an edge's gradient with respect to rotations of its target."""
    _h, weight, _carry = step_times(ni, w, rod, step)
    inertia = weighted_inertia(ni, w, rod, weight)
    im, momentum_map = turn_from_target(
        load4(w, orientation_at(ni, rod, step + HISTORY_SLOTS, i)),
        load4(w, target_orientation_at(ni, rod, step, i)),
    )
    momentum = 2.0 * inertia * im
    coupling = cross_matrix(momentum)
    for a in ti.static(range(3)):
        for b in ti.static(range(3)):
            coupling[a, b] += 2.0 * momentum_map[b, a] * inertia[b]
    return 0.5 * (momentum.outer_product(im) - coupling @ momentum_map.transpose())


@ti.func
def add_parameter_derivative(ni: ti.template(), w: ti.template(), rod, p, j, v):
    """Add to the derivative of the gradient at block j with respect to parameter p."""
    start = parameter_derivatives_at(ni, rod, p // GROUP_COLUMNS, j) + p % GROUP_COLUMNS
    for a in ti.static(range(3)):
        w[start + GROUP_COLUMNS * a] = w[start + GROUP_COLUMNS * a] + v[a]
