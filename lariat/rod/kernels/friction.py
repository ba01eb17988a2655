"""Coulomb friction on obstacles: a return mapping of each sample that touches, with its slip.

A sample x_s of an edge (see `obstacle_contact`) touches with its surface, at the lever -r n from
the centre line. From one solve to the next the material there moves by x_s - x1_s - r w x n, with
the rotation w of the edge, which lets a round rod roll. With the slip e1 of the solve before, in
the plane across the normal n,

    u = (I - n n^T) (e1 + x_s - x1_s - r w x n),
    t = k u          where k |u| <= mu f: the sample sticks,
    t = mu f u / |u|     else: it slides,            e = t / k,

with the normal force f, the coefficient mu, and a stiffness k that is that of contact. The rod
feels -t at its surface: -t at x_s, and the moment r n x t on the edge. The point at rest on the
obstacle, the anchor, lies e behind the surface. A load below mu f never moves the rod by more than
its slip, whatever time it acts.

In slip, t depends on f: its derivative is not symmetric, nor is the Hessian (which then is the
Jacobian of the equations), so that it and its transpose are factorized. A line search takes the
energy of friction at a limit mu f that is frozen from one iterate to the next.
"""

from lariat.kernel_cache.language import ti
from lariat.rod.kernels.addressing import (
    hessian_at,
    orientation_at,
    parameter_code_at,
    position_at,
    scalar,
    sensitivity_columns_at,
    slip_at,
    steady_groups,
    transposed_at,
)
from lariat.rod.kernels.memory import (
    add,
    add33,
    bounded,
    lane_count,
    load3,
    load4,
    load33,
    load_column,
    load_lane3,
    load_lane4,
    load_lane33,
    store,
    store33,
    store_column,
    store_lane,
    store_lane33,
)
from lariat.rod.kernels.rotations import (
    cross_matrix,
    left_jacobian_inverse,
    log_coefficients,
    logarithm,
    relative_rotation,
    rotation_matrix,
)
from lariat.rod.kernels.step_terms import add_parameter_derivative
from lariat.rod.kernels.types import Doubles, Integers
from lariat.rod.launch.codes import FrictionMode, HessianPart
from lariat.rod.launch.layout import (
    COLUMNS_STRIDE,
    COLUMNS_WIDTH,
    FRICTION_CONTACT_WIDTH,
    FRICTION_HEAD,
    FROZEN_FRICTION_WIDTH,
    GROUP_COLUMNS,
    HISTORY_SLOTS,
    LANE_COUNT,
    LANE_STRIDE,
    OBSTACLE_WIDTH,
    FrictionContact,
    FrozenFriction,
    Header,
    ObstacleRow,
    ParameterCode,
    Scalar,
    Section,
)


@ti.func
def friction_stiffness(ni: ti.template(), w: ti.template(), rod):
    """Tangential stiffness of a sample [N/m]."""
    length = scalar(ni, w, rod, Scalar.EDGE_LENGTH)
    return scalar(ni, w, rod, Scalar.CONTACT_STIFFNESS) * length / ni[Header.CONTACT_SAMPLES]


@ti.func
def surface_radius(ni: ti.template(), w: ti.template(), rod):
    """Radius of the rod [m]."""
    return scalar(ni, w, rod, Scalar.CONTACT_REACH) - scalar(ni, w, rod, Scalar.CONTACT_MARGIN)


@ti.func
def contact_count(ni: ti.template(), w: ti.template(), rod):
    """Number of pairs that touch."""
    return ti.cast(w[rod + ni[Section.FRICTION_CONTACTS]], ti.i32)


@ti.func
def contact_at(ni: ti.template(), rod, a):
    """Offset of a `FrictionContact`."""
    return rod + ni[Section.FRICTION_CONTACTS] + FRICTION_HEAD + FRICTION_CONTACT_WIDTH * a


@ti.func
def sample_between(w: ti.template(), at, s):
    """Point between a node and the next one, whose blocks of three numbers are at `at`."""
    return (1.0 - s) * load3(w, at) + s * load3(w, at + 3)


@ti.func
def limited_energy(size, limit, k):
    """Energy of a slip of some size, at a given largest force."""
    return ti.select(
        k * size <= limit, 0.5 * k * size * size, limit * size - 0.5 * limit * limit / k
    )


@ti.func
def moment_arm(ni: ti.template(), w: ti.template(), rod, step, entry):
    """Matrix M of the moment M t that a pull adds to the gradient of its edge, in its frame."""
    edge = ti.cast(w[entry + FrictionContact.EDGE], ti.i32)
    frame = rotation_matrix(load4(w, orientation_at(ni, rod, step + HISTORY_SLOTS, edge)))
    normal = load3(w, entry + FrictionContact.NORMAL)
    return -surface_radius(ni, w, rod) * (frame.transpose() @ cross_matrix(normal))


@ti.real_func
def friction_energy(ni: Integers, w: Doubles, rod: ti.i32, step: ti.i32, part: ti.i32) -> ti.f64:
    """Add energy, gradient and Hessian of friction at all samples that touch.

    The blocks of the transposed Hessian get the differences from those of the Hessian. With the
    direction d in which a sample slides, or d = 0 where it sticks, the pull t changes by

        secant (I - n n^T - d d^T) du,

    where rotations w of the edge change u by r n x w. The moment of the pull follows n x t.
    """
    mode = w[rod + ni[Section.FRICTION_CONTACTS] + 1]
    k = friction_stiffness(ni, w, rod)
    radius = surface_radius(ni, w, rod)
    exact = ti.select(part == HessianPart.POSITIVE, 0.0, 1.0)
    with_hessian = part != HessianPart.NONE
    if with_hessian:
        zero = ti.Matrix.zero(ti.f64, 3, 3)
        for j in range(2 * ni[Header.NODES] - 1):
            m = transposed_at(ni, rod, step, j)
            store33(w, m + 9, zero)
            store33(w, m + 18, zero)
    for_derivatives = mode == FrictionMode.FINAL and ni[Header.DERIVATIVES] > 0
    with_blocks = with_hessian or for_derivatives
    as_before = ti.select(mode == FrictionMode.FIRST, 1.0, 0.0)
    lanes = bounded(rod + ni[Section.LANES])
    count = contact_count(ni, w, rod)
    for strip in range((count + LANE_COUNT - 1) // LANE_COUNT):
        first = LANE_COUNT * strip
        width = ti.min(LANE_COUNT, count - first)
        for lane in range(width):
            at = lanes + lane
            entry = contact_at(ni, rod, first + lane)
            edge = ti.cast(w[entry + FrictionContact.EDGE], ti.i32)
            pair = ti.cast(w[entry + FrictionContact.PAIR], ti.i32)
            frozen = frozen_at(ni, rod, pair)
            s = w[entry + FrictionContact.PLACE]
            place = position_at(ni, rod, step + HISTORY_SLOTS, edge)
            before = position_at(ni, rod, step + HISTORY_SLOTS - 1, edge)
            moved = sample_between(w, place, s) - sample_between(w, before, s)
            store_lane(w, at, 0, moved + load3(w, slip_at(ni, rod, step, pair)))
            store_lane(w, at, 3, load4(w, orientation_at(ni, rod, step + HISTORY_SLOTS - 1, edge)))
            store_lane(w, at, 7, load4(w, orientation_at(ni, rod, step + HISTORY_SLOTS, edge)))
            store_lane(w, at, 11, load3(w, entry + FrictionContact.NORMAL))
            coefficient = w[entry + FrictionContact.COEFFICIENT]
            known = mode <= FrictionMode.NEWTON and w[frozen + FrozenFriction.LIMIT] > 0.0
            numbers = ti.Vector(
                [
                    coefficient * w[entry + FrictionContact.NORMAL_FORCE],
                    exact * coefficient * w[entry + FrictionContact.NORMAL_STIFFNESS],
                    ti.select(known, 1.0, 0.0),
                ]
            )
            store_lane(w, at, 14, numbers)
            store_lane(w, at, 17, load3(w, frozen + FrozenFriction.DIRECTION))
            if with_blocks:
                store_lane33(w, at, 20, load33(w, entry + FrictionContact.CURVATURE))
        for lane in range(lane_count(width)):
            at = lanes + lane
            q1, q = load_lane4(w, at, 3), load_lane4(w, at, 7)
            n, slid = load_lane3(w, at, 11), load_lane3(w, at, 17)
            limit = w[at + LANE_STRIDE * 14]
            known = w[at + LANE_STRIDE * 16]
            turn = rotation_matrix(q1) @ logarithm(relative_rotation(q1, q))
            moved = load_lane3(w, at, 0) - radius * turn.cross(n)
            off = n.dot(moved)
            u = moved - off * n
            size = ti.sqrt(u.dot(u)) + 1e-300
            slides = ti.select(k * size > limit, 1.0, 0.0)
            # The first iterate of a solve slides where the solve before did.
            slid_before = ti.select(slid.dot(slid) > 0.0, 1.0, 0.0)
            slides = ti.select(as_before * known > 0.0, slid_before, slides)
            # A sample that turns back sticks in the next linear solve, whatever force that takes.
            slides = ti.select(known * u.dot(slid) < 0.0, 0.0, slides)
            secant = ti.select(slides > 0.0, limit / size, k)
            pull = secant * u
            store_lane(w, at, 29, u)
            store_lane(w, at, 32, (slides / size) * u)
            store_lane(w, at, 35, pull)
            store_lane(w, at, 38, -radius * (rotation_matrix(q).transpose() @ n.cross(pull)))
            store_lane(w, at, 41, turn)
            store_lane(w, at, 44, ti.Vector([secant, off]))
        for lane in range(ti.select(with_blocks, lane_count(width), 0)):
            at = lanes + lane
            q1, q = load_lane4(w, at, 3), load_lane4(w, at, 7)
            n, along = load_lane3(w, at, 11), load_lane3(w, at, 32)
            pull, turn = load_lane3(w, at, 35), load_lane3(w, at, 41)
            stiffening = w[at + LANE_STRIDE * 15]
            secant, off = w[at + LANE_STRIDE * 44], w[at + LANE_STRIDE * 45]
            curvature = exact * load_lane33(w, at, 20)
            relative = relative_rotation(q1, q)
            c, _d = log_coefficients(relative)
            frame = rotation_matrix(q)
            inverse = left_jacobian_inverse(logarithm(relative), c)
            by_turn = rotation_matrix(q1) @ inverse.transpose()
            for a in ti.static(range(3)):
                for b in ti.static(range(3)):
                    by_turn[a, b] = ti.select(exact > 0.0, by_turn[a, b], frame[a, b])
            by_slip = -secant * (n.outer_product(n) + along.outer_product(along))
            for a in ti.static(range(3)):
                by_slip[a, a] += secant
            by_sample = by_slip - (stiffening * along).outer_product(n)
            by_sample -= radius * (rows_cross(by_slip, turn) @ curvature)
            by_sample -= n.outer_product(curvature @ pull)
            by_sample -= (secant * off) * (curvature - along.outer_product(curvature @ along))
            turning = radius * (rows_cross(by_slip, n) @ by_turn)
            lever = -radius * frame.transpose()
            torque_by = cross_columns(n, by_sample) - cross_columns(pull, curvature)
            # A turn of the edge moves the surface by the transpose of the lever, but for a long
            # step. The energies leave out half of the cross matrix of their moments, which add up
            # to zero with this one at the solution.
            by_rotation = lever @ cross_columns(n, turning)
            by_rotation += (0.5 * exact) * cross_matrix(load_lane3(w, at, 38))
            # The results take the places of what has been read.
            store_lane33(w, at, 0, lever @ torque_by)
            store_lane33(w, at, 9, turning)
            store_lane33(w, at, 20, by_sample)
            store_lane33(w, at, 41, by_rotation)
        for lane in range(width):
            at = lanes + lane
            entry = contact_at(ni, rod, first + lane)
            edge = ti.cast(w[entry + FrictionContact.EDGE], ti.i32)
            s = w[entry + FrictionContact.PLACE]
            g = rod + ni[Section.GRADIENT] + 6 * edge
            pull, along = load_lane3(w, at, 35), load_lane3(w, at, 32)
            store(w, entry + FrictionContact.SLIP, load_lane3(w, at, 29))
            store(w, entry + FrictionContact.DIRECTION, along)
            store(w, entry + FrictionContact.PULL, pull)
            add(w, g, (1.0 - s) * pull)
            add(w, g + 3, load_lane3(w, at, 38))
            add(w, g + 6, s * pull)
            if with_hessian:
                moment_by = load_lane33(w, at, 0)
                turning = load_lane33(w, at, 9)
                by_sample = load_lane33(w, at, 20)
                m = hessian_at(ni, rod, step, 2 * edge)
                r = transposed_at(ni, rod, step, 2 * edge)
                add33(w, m, ((1.0 - s) * (1.0 - s)) * by_sample)
                add33(w, m + 9, (1.0 - s) * moment_by)
                add33(w, m + 18, (s * (1.0 - s)) * by_sample)
                add33(w, m + 27, load_lane33(w, at, 41))
                add33(w, m + 36, s * turning)
                add33(w, m + 54, (s * s) * by_sample)
                add33(w, r + 9, (1.0 - s) * (turning.transpose() - moment_by))
                add33(w, r + 18, (s * (1.0 - s)) * (by_sample.transpose() - by_sample))
                add33(w, r + 36, s * (moment_by.transpose() - turning))
            if for_derivatives:
                n = load3(w, entry + FrictionContact.NORMAL)
                force = w[entry + FrictionContact.NORMAL_FORCE]
                sliding = along.dot(along) > 0.0
                secant = ti.select(sliding, pull.dot(along) / load_lane3(w, at, 29).dot(along), k)
                by_slip = -secant * (n.outer_product(n) + along.outer_product(along))
                for a in ti.static(range(3)):
                    by_slip[a, a] += secant
                store33(w, entry + FrictionContact.BY_SAMPLE, load_lane33(w, at, 20))
                store33(w, entry + FrictionContact.BY_ROTATION, load_lane33(w, at, 9))
                store33(w, entry + FrictionContact.BY_SLIP, by_slip)
                store(w, entry + FrictionContact.BY_COEFFICIENT, force * along)
    energy = 0.0
    if mode == FrictionMode.LINE_SEARCH:
        energy = frozen_energy(ni, w, rod, step)
    return energy


@ti.func
def rows_cross(m, v):
    """m [v]x, without products with zeros."""
    return ti.Matrix.rows([ti.Vector([m[a, 0], m[a, 1], m[a, 2]]).cross(v) for a in range(3)])


@ti.func
def cross_columns(v, m):
    """[v]x m, without products with zeros."""
    return ti.Matrix.cols([v.cross(ti.Vector([m[0, a], m[1, a], m[2, a]])) for a in range(3)])


@ti.real_func
def frozen_energy(ni: Integers, w: Doubles, rod: ti.i32, step: ti.i32) -> ti.f64:
    """Energy of friction at the limits of the iterate that a line search has accepted."""
    energy = 0.0
    k = friction_stiffness(ni, w, rod)
    radius = surface_radius(ni, w, rod)
    for a in range(contact_count(ni, w, rod)):
        entry = contact_at(ni, rod, a)
        edge = ti.cast(w[entry + FrictionContact.EDGE], ti.i32)
        frozen = frozen_at(ni, rod, ti.cast(w[entry + FrictionContact.PAIR], ti.i32))
        limit = w[frozen + FrozenFriction.LIMIT]
        s = w[entry + FrictionContact.PLACE]
        q = load4(w, orientation_at(ni, rod, step + HISTORY_SLOTS, edge))
        accepted = load4(w, rod + ni[Section.ACCEPTED_ORIENTATIONS] + 4 * edge)
        n = load3(w, frozen + FrozenFriction.NORMAL)
        turn = rotation_matrix(accepted) @ logarithm(relative_rotation(accepted, q))
        u = sample_between(w, position_at(ni, rod, step + HISTORY_SLOTS, edge), s)
        u -= sample_between(w, rod + ni[Section.ACCEPTED_POSITIONS] + 3 * edge, s)
        u += load3(w, frozen + FrozenFriction.SLIP) - radius * turn.cross(n)
        u -= n.dot(u) * n
        of = limited_energy(ti.sqrt(u.dot(u)), limit, k)
        w[entry + FrictionContact.FROZEN_ENERGY] = of
        energy += of
    return energy


@ti.func
def frozen_at(ni: ti.template(), rod, pair):
    """Offset of a `FrozenFriction`."""
    return rod + ni[Section.FROZEN_FRICTION] + FROZEN_FRICTION_WIDTH * pair


@ti.real_func
def freeze_friction(ni: Integers, w: Doubles, rod: ti.i32) -> ti.f64:
    """Freeze all pairs at the accepted iterate; return the change of energy by that."""
    change = 0.0
    k = friction_stiffness(ni, w, rod)
    head = rod + ni[Section.FRICTION_CONTACTS]
    if w[head + 1] == FrictionMode.FIRST:
        w[head + 1] = FrictionMode.NEWTON
    searches = w[head + 1] == FrictionMode.LINE_SEARCH
    for pair in range(ni[Header.FRICTION_PAIRS]):
        w[frozen_at(ni, rod, pair) + FrozenFriction.LIMIT] = 0.0
    for a in range(contact_count(ni, w, rod)):
        entry = contact_at(ni, rod, a)
        at = frozen_at(ni, rod, ti.cast(w[entry + FrictionContact.PAIR], ti.i32))
        limit = w[entry + FrictionContact.COEFFICIENT] * w[entry + FrictionContact.NORMAL_FORCE]
        slip = load3(w, entry + FrictionContact.SLIP)
        if searches:
            change += limited_energy(ti.sqrt(slip.dot(slip)), limit, k)
            change -= w[entry + FrictionContact.FROZEN_ENERGY]
        store(w, at + FrozenFriction.DIRECTION, load3(w, entry + FrictionContact.DIRECTION))
        store(w, at + FrozenFriction.NORMAL, load3(w, entry + FrictionContact.NORMAL))
        store(w, at + FrozenFriction.SLIP, slip)
        w[at + FrozenFriction.LIMIT] = limit
    return change


@ti.real_func
def update_slips(ni: Integers, w: Doubles, rod: ti.i32, step: ti.i32) -> ti.i32:
    """Set the slips after a solve; that of a sample that does not touch is zero."""
    k = friction_stiffness(ni, w, rod)
    for pair in range(3 * ni[Header.FRICTION_PAIRS]):
        w[slip_at(ni, rod, step + 1, 0) + pair] = 0.0
    for a in range(contact_count(ni, w, rod)):
        entry = contact_at(ni, rod, a)
        pair = ti.cast(w[entry + FrictionContact.PAIR], ti.i32)
        store(w, slip_at(ni, rod, step + 1, pair), load3(w, entry + FrictionContact.PULL) / k)
    return 0


@ti.real_func
def friction_parameter_derivatives(ni: Integers, w: Doubles, rod: ti.i32, step: ti.i32) -> ti.i32:
    """Add friction to the derivatives in coefficients, and its moments to those in the length.

    The forces of contact in the gradient, which are proportional to the length, contain its forces.
    """
    edges = ni[Header.END_EDGE] - ni[Header.FIRST_EDGE]
    per_length = 1.0 / (edges * scalar(ni, w, rod, Scalar.EDGE_LENGTH))
    for p in range(ni[Header.PARAMETERS]):
        code = ni[parameter_code_at(ni, p)]
        for a in range(contact_count(ni, w, rod)):
            entry = contact_at(ni, rod, a)
            edge = ti.cast(w[entry + FrictionContact.EDGE], ti.i32)
            s = w[entry + FrictionContact.PLACE]
            arm = moment_arm(ni, w, rod, step, entry)
            if code == ParameterCode.LENGTH:
                moment = per_length * (arm @ load3(w, entry + FrictionContact.PULL))
                add_parameter_derivative(ni, w, rod, p, 2 * edge + 1, moment)
            pull = by_parameter(ni, w, rod, entry, p)
            if code == ParameterCode.FRICTION or code == ParameterCode.FRICTION_FACTOR:
                add_parameter_derivative(ni, w, rod, p, 2 * edge, (1.0 - s) * pull)
                add_parameter_derivative(ni, w, rod, p, 2 * edge + 1, arm @ pull)
                add_parameter_derivative(ni, w, rod, p, 2 * edge + 2, s * pull)
    return 0


@ti.func
def obstacle_of(ni: ti.template(), w: ti.template(), entry):
    """Index of the obstacle of a pair."""
    pairs = (ni[Header.END_EDGE] - ni[Header.FIRST_EDGE]) * ni[Header.CONTACT_SAMPLES]
    return ti.cast(w[entry + FrictionContact.PAIR], ti.i32) // pairs


@ti.func
def by_parameter(ni: ti.template(), w: ti.template(), rod, entry, p):
    """Derivative of the pull with respect to parameter p, at a given motion."""
    code = ni[parameter_code_at(ni, p)]
    body = obstacle_of(ni, w, entry)
    own = code == ParameterCode.FRICTION and ni[parameter_code_at(ni, p) + 1] == body
    change = ti.select(own, scalar(ni, w, rod, Scalar.FRICTION_FACTOR), 0.0)
    coefficient = w[ni[Header.OBSTACLE_ROWS] + OBSTACLE_WIDTH * body + ObstacleRow.FRICTION]
    change = ti.select(code == ParameterCode.FRICTION_FACTOR, coefficient, change)
    return change * load3(w, entry + FrictionContact.BY_COEFFICIENT)


@ti.func
def slip_columns_at(ni: ti.template(), rod, group, pair):
    """Offset of the columns of a slip, for a group."""
    place = group * ni[Header.FRICTION_PAIRS] + pair
    return bounded(rod + ni[Section.SLIP_SENSITIVITIES] + COLUMNS_WIDTH * place)


@ti.func
def pull_before(ni: ti.template(), w: ti.template(), rod, step, group, history, entry, c):
    """Derivative of the pull, in column c, through what was before the solve."""
    edge = ti.cast(w[entry + FrictionContact.EDGE], ti.i32)
    pair = ti.cast(w[entry + FrictionContact.PAIR], ti.i32)
    s = w[entry + FrictionContact.PLACE]
    slip = slip_columns_at(ni, rod, group, pair)
    touched = w[rod + ni[Section.SLIP_STAMPS] + pair] == step - 1
    at = bounded(sensitivity_columns_at(ni, rod, group)[0] + 2 * COLUMNS_STRIDE * edge) + c
    old = at + COLUMNS_WIDTH
    known = ti.select(history > 0, 1.0, 0.0)
    moved = (1.0 - s) * load_column(w, old) + s * load_column(w, old + 2 * COLUMNS_STRIDE)
    moved = ti.select(touched, load_column(w, slip + c), 0.0) - ti.select(known > 0.0, moved, 0.0)
    turned = ti.select(known > 0.0, load_column(w, old + COLUMNS_STRIDE), 0.0)
    return (
        load33(w, entry + FrictionContact.BY_SLIP) @ moved
        - load33(w, entry + FrictionContact.BY_ROTATION) @ turned
    )


@ti.real_func
def friction_sensitivities(
    ni: Integers, w: Doubles, rod: ti.i32, step: ti.i32, group: ti.i32, history: ti.i32
) -> ti.i32:
    """Subtract from a group of columns what friction takes over from before the solve.

    Args:
        group: Group of columns.
        history: Number of solves before this one that they depend on.
    """
    first = ni[Header.FIRST_FREE]
    end = ni[Header.END_FREE]
    start = sensitivity_columns_at(ni, rod, group)[0]
    for a in range(contact_count(ni, w, rod)):
        entry = contact_at(ni, rod, a)
        edge = ti.cast(w[entry + FrictionContact.EDGE], ti.i32)
        s = w[entry + FrictionContact.PLACE]
        arm = moment_arm(ni, w, rod, step, entry)
        at = bounded(start + 2 * COLUMNS_STRIDE * edge)
        for c in range(GROUP_COLUMNS):
            pull = pull_before(ni, w, rod, step, group, history, entry, c)
            if 2 * edge >= first:
                store_column(w, at + c, load_column(w, at + c) - (1.0 - s) * pull)
            to = at + COLUMNS_STRIDE + c
            store_column(w, to, load_column(w, to) - arm @ pull)
            to += COLUMNS_STRIDE
            if 2 * edge + 2 < end:
                store_column(w, to, load_column(w, to) - s * pull)
    return 0


@ti.real_func
def slip_sensitivities(
    ni: Integers, w: Doubles, rod: ti.i32, step: ti.i32, group: ti.i32, history: ti.i32
) -> ti.i32:
    """Carry the columns of the slips over a solve, after those of the unknowns."""
    k = friction_stiffness(ni, w, rod)
    driven = ni[Header.ACTION_GROUPS]
    start = sensitivity_columns_at(ni, rod, group)[0]
    for a in range(contact_count(ni, w, rod)):
        entry = contact_at(ni, rod, a)
        edge = ti.cast(w[entry + FrictionContact.EDGE], ti.i32)
        pair = ti.cast(w[entry + FrictionContact.PAIR], ti.i32)
        s = w[entry + FrictionContact.PLACE]
        by_sample = load33(w, entry + FrictionContact.BY_SAMPLE)
        by_rotation = load33(w, entry + FrictionContact.BY_ROTATION)
        at = bounded(start + 2 * COLUMNS_STRIDE * edge)
        to = slip_columns_at(ni, rod, group, pair)
        for c in range(GROUP_COLUMNS):
            pull = pull_before(ni, w, rod, step, group, history, entry, c)
            x = load_column(w, at + c)
            x = (1.0 - s) * x + s * load_column(w, at + 2 * COLUMNS_STRIDE + c)
            pull += by_sample @ x + by_rotation @ load_column(w, at + COLUMNS_STRIDE + c)
            p = (group - driven) * GROUP_COLUMNS + c
            if group >= driven and group < steady_groups(ni) and p < ni[Header.PARAMETERS]:
                pull += by_parameter(ni, w, rod, entry, p)
            store_column(w, to + c, pull / k)
    return 0


@ti.real_func
def stamp_slips(ni: Integers, w: Doubles, rod: ti.i32, step: ti.i32) -> ti.i32:
    """Mark the pairs that touch, of which the columns of the slips hold."""
    for a in range(contact_count(ni, w, rod)):
        pair = ti.cast(w[contact_at(ni, rod, a) + FrictionContact.PAIR], ti.i32)
        w[rod + ni[Section.SLIP_STAMPS] + pair] = step
    return 0


@ti.real_func
def seed_slips(ni: Integers, w: Doubles, rod: ti.i32, step: ti.i32) -> ti.i32:
    """Carry the adjoint of the slips after a solve on to its unknowns."""
    k = friction_stiffness(ni, w, rod)
    new = rod + ni[Section.ADJOINT] + 3 * (2 * ni[Header.NODES] - 1) * (step + HISTORY_SLOTS)
    slips = rod + ni[Section.SLIP_ADJOINT]
    for a in range(contact_count(ni, w, rod)):
        entry = contact_at(ni, rod, a)
        edge = ti.cast(w[entry + FrictionContact.EDGE], ti.i32)
        s = w[entry + FrictionContact.PLACE]
        carried = load3(w, slips + 3 * ti.cast(w[entry + FrictionContact.PAIR], ti.i32)) / k
        store(w, entry + FrictionContact.CARRIED, carried)
        x = load33(w, entry + FrictionContact.BY_SAMPLE).transpose() @ carried
        turn = load33(w, entry + FrictionContact.BY_ROTATION).transpose() @ carried
        add(w, new + 6 * edge, (1.0 - s) * x)
        add(w, new + 6 * edge + 3, turn)
        add(w, new + 6 * edge + 6, s * x)
    for j in range(3 * ni[Header.FRICTION_PAIRS]):
        w[slips + j] = 0.0
    return 0


@ti.real_func
def friction_adjoint(ni: Integers, w: Doubles, rod: ti.i32, step: ti.i32) -> ti.i32:
    """Carry the adjoint of a solve over friction to the solve and the slips before it.

    Driven blocks take no part in the solve: only the free ones pull.
    """
    first = ni[Header.FIRST_FREE]
    end = ni[Header.END_FREE]
    count = 2 * ni[Header.NODES] - 1
    new = rod + ni[Section.ADJOINT] + 3 * count * (step + HISTORY_SLOTS)
    old = new - 3 * count
    for a in range(contact_count(ni, w, rod)):
        entry = contact_at(ni, rod, a)
        edge = ti.cast(w[entry + FrictionContact.EDGE], ti.i32)
        pair = ti.cast(w[entry + FrictionContact.PAIR], ti.i32)
        s = w[entry + FrictionContact.PLACE]
        arm = moment_arm(ni, w, rod, step, entry)
        pull = load3(w, entry + FrictionContact.CARRIED)
        pull -= arm.transpose() @ load3(w, new + 6 * edge + 3)
        if 2 * edge >= first:
            pull -= (1.0 - s) * load3(w, new + 6 * edge)
        if 2 * edge + 2 < end:
            pull -= s * load3(w, new + 6 * edge + 6)
        slip = load33(w, entry + FrictionContact.BY_SLIP).transpose() @ pull
        turn = load33(w, entry + FrictionContact.BY_ROTATION).transpose() @ pull
        store(w, rod + ni[Section.SLIP_ADJOINT] + 3 * pair, slip)
        add(w, old + 6 * edge, -(1.0 - s) * slip)
        add(w, old + 6 * edge + 3, -turn)
        add(w, old + 6 * edge + 6, -s * slip)
        carried = load3(w, entry + FrictionContact.CARRIED)
        for p in range(ni[Header.PARAMETERS]):
            to = rod + ni[Section.PARAMETERS_OUT] + p
            w[to] = w[to] + carried.dot(by_parameter(ni, w, rod, entry, p))
    return 0
