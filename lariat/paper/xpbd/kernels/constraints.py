"""Corrections (11) of single constraints, and their adjoints.

A correction evaluates a constraint's value C and Jacobian J, changes the multiplier by
dl = -(J W J^T + compliance)^-1 (C + compliance * multiplier), and positions and quaternions by
W J^T dl (3), and normalizes the quaternions. For both Jacobians J J^T is a multiple of the
identity, so that the inverse is a number. The printed signs of (4) and the printed Jacobians (9),
(10) contradict the rest of the paper; those used here are derived independently.
"""

from lariat.kernel_cache.language import ti
from lariat.paper.xpbd.kernels.addressing import place, scalar
from lariat.paper.xpbd.kernels.quaternions import (
    director,
    director_derivative,
    director_transpose,
    relative_imaginary,
    times_vector,
)
from lariat.paper.xpbd.launch.layout import (
    BEND_TAPE_WIDTH,
    CONTACT_TAPE_WIDTH,
    CONTACT_WIDTH,
    STRETCH_TAPE_WIDTH,
    Header,
    Scalar,
    Section,
)
from lariat.rod.kernels.memory import add, load3, load4, store
from lariat.rod.kernels.step_terms import bend_share

Constants = ti.types.struct(
    mass=ti.f64, inertia=ti.f64, per_length=ti.f64, bending=ti.f64, contact=ti.f64
)
"""Inverse mass, inverse inertia, inverse edge length, compliances over the step squared."""


@ti.func
def step_constants(ni: ti.template(), w: ti.template(), rod):
    """Read the constants of a step once: the compiler would read them again after every store."""
    h = scalar(ni, w, rod, Scalar.STEP_DURATION)
    return Constants(
        mass=scalar(ni, w, rod, Scalar.INVERSE_MASS),
        inertia=scalar(ni, w, rod, Scalar.INVERSE_INERTIA),
        per_length=1.0 / scalar(ni, w, rod, Scalar.EDGE_LENGTH),
        bending=scalar(ni, w, rod, Scalar.BENDING_COMPLIANCE) / (h * h),
        contact=scalar(ni, w, rod, Scalar.CONTACT_COMPLIANCE) / (h * h),
    )


@ti.func
def node_weight(ni: ti.template(), c, i):
    """Inverse mass of a node; zero for a node that a grip places."""
    return ti.select(i >= ni[Header.FIRST_NODE] and i < ni[Header.END_NODE], c.mass, 0.0)


@ti.func
def edge_weight(ni: ti.template(), c, i):
    """Inverse inertia of an edge; zero for an edge that a grip places."""
    return ti.select(i >= ni[Header.FIRST_EDGE] and i < ni[Header.END_EDGE], c.inertia, 0.0)


@ti.func
def bend_compliance(ni: ti.template(), c, i):
    """Compliance of bend i over the step squared, in proportion to the length that it acts over."""
    n = ni[Header.NODES]
    share = bend_share(i, n - 2, ni[Header.FIRST_EDGE], n - 1 - ni[Header.END_EDGE])
    return share * c.bending


@ti.func
def correct_stretch(ni: ti.template(), w: ti.template(), c, rod, slot, sweep, i):
    """Constraint (4): an edge lies along its own third axis, at its own length; no compliance."""
    n = ni[Header.NODES]
    w1, w2 = node_weight(ni, c, i), node_weight(ni, c, i + 1)
    wq = edge_weight(ni, c, i)
    x = place(ni, rod, Section.POSITIONS, 3 * (slot * n + i))
    q_at = place(ni, rod, Section.ORIENTATIONS, 4 * (slot * (n - 1) + i))
    x1, x2, q = load3(w, x), load3(w, x + 3), load4(w, q_at)
    inverse = 1.0 / ((w1 + w2) * c.per_length * c.per_length + 4.0 * wq)
    dl = -inverse * ((x2 - x1) * c.per_length - director(q))
    store(w, x, x1 - (w1 * c.per_length) * dl)
    store(w, x + 3, x2 + (w2 * c.per_length) * dl)
    p = q - wq * director_transpose(q, dl)
    shrink = 1.0 / ti.sqrt(p.dot(p))
    store(w, q_at, shrink * p)
    tape = place(ni, rod, Section.STRETCH_TAPE, STRETCH_TAPE_WIDTH * (sweep * (n - 1) + i))
    store(w, tape, q)
    store(w, tape + 4, dl)
    w[tape + 7] = shrink


@ti.func
def correct_stretch_adjoint(ni: ti.template(), w: ti.template(), c, rod, sweep, i):
    """Return derivatives with respect to the inverse mass and the inverse inertia."""
    n = ni[Header.NODES]
    w1, w2 = node_weight(ni, c, i), node_weight(ni, c, i + 1)
    wq = edge_weight(ni, c, i)
    tape = place(ni, rod, Section.STRETCH_TAPE, STRETCH_TAPE_WIDTH * (sweep * (n - 1) + i))
    q, dl, shrink = load4(w, tape), load3(w, tape + 4), w[tape + 7]
    x = place(ni, rod, Section.D_NODES, 3 * i)
    q_at = place(ni, rod, Section.D_EDGES, 4 * i)
    x1, x2, after = load3(w, x), load3(w, x + 3), load4(w, q_at)
    pull = director_transpose(q, dl)
    unit = shrink * (q - wq * pull)
    p = shrink * (after - unit.dot(after) * unit)
    inverse = 1.0 / ((w1 + w2) * c.per_length * c.per_length + 4.0 * wq)
    d_dl = c.per_length * (w2 * x2 - w1 * x1) - wq * director_derivative(q, p)
    d_value = -inverse * d_dl
    store(w, x, x1 - c.per_length * d_value)
    store(w, x + 3, x2 + c.per_length * d_value)
    store(w, q_at, p - wq * director_transpose(p, dl) - director_transpose(q, d_value))
    d_denominator = -inverse * dl.dot(d_dl)
    d_mass = (w1 + w2) * c.per_length * c.per_length * d_denominator
    d_mass += c.per_length * dl.dot(w2 * x2 - w1 * x1)
    d_inertia = wq * (4.0 * d_denominator - pull.dot(p))
    return d_mass / c.mass, d_inertia / c.inertia


@ti.func
def correct_bend(ni: ti.template(), w: ti.template(), c, rod, step, slot, sweep, i):
    """Constraint (7), (8): edges i and i + 1 have their Darboux vector at rest, with compliance."""
    n = ni[Header.NODES]
    w1, w2 = edge_weight(ni, c, i), edge_weight(ni, c, i + 1)
    q_at = place(ni, rod, Section.ORIENTATIONS, 4 * (slot * (n - 1) + i))
    stored = ti.select(ni[Header.TAPED] > 0, step, 0)
    l_at = place(ni, rod, Section.MULTIPLIERS, 3 * (stored * (n - 2) + i))
    q1, q2, multiplier = load4(w, q_at), load4(w, q_at + 4), load3(w, l_at)
    turn, rest = relative_imaginary(q1, q2), load3(w, place(ni, rod, Section.REST_DARBOUX, 3 * i))
    # The sign of the whole quaternion: that of its vector part would let a curved rod rest bent
    # either way at every node.
    sign = ti.select(q1.dot(q2) < 0.0, -1.0, 1.0)
    compliance = bend_compliance(ni, c, i)
    inverse = 1.0 / (w1 + w2 + compliance)
    dl = -inverse * (turn - sign * rest + compliance * multiplier)
    store(w, l_at, multiplier + dl)
    p1, p2 = q1 - w1 * times_vector(q2, dl), q2 + w2 * times_vector(q1, dl)
    shrink1, shrink2 = 1.0 / ti.sqrt(p1.dot(p1)), 1.0 / ti.sqrt(p2.dot(p2))
    store(w, q_at, shrink1 * p1)
    store(w, q_at + 4, shrink2 * p2)
    tape = place(ni, rod, Section.BEND_TAPE, BEND_TAPE_WIDTH * (sweep * (n - 2) + i))
    store(w, tape, q1)
    store(w, tape + 4, q2)
    store(w, tape + 8, dl)
    w[tape + 11] = shrink1
    w[tape + 12] = shrink2


@ti.func
def correct_bend_adjoint(ni: ti.template(), w: ti.template(), c, rod, step, sweep, i):
    """Return derivatives with respect to the inverse inertia and to compliance / h^2."""
    n = ni[Header.NODES]
    w1, w2 = edge_weight(ni, c, i), edge_weight(ni, c, i + 1)
    tape = place(ni, rod, Section.BEND_TAPE, BEND_TAPE_WIDTH * (sweep * (n - 2) + i))
    q1, q2, dl = load4(w, tape), load4(w, tape + 4), load3(w, tape + 8)
    shrink1, shrink2 = w[tape + 11], w[tape + 12]
    q_at = place(ni, rod, Section.D_EDGES, 4 * i)
    after1, after2 = load4(w, q_at), load4(w, q_at + 4)
    pull1, pull2 = -times_vector(q2, dl), times_vector(q1, dl)
    unit1, unit2 = shrink1 * (q1 + w1 * pull1), shrink2 * (q2 + w2 * pull2)
    p1 = shrink1 * (after1 - unit1.dot(after1) * unit1)
    p2 = shrink2 * (after2 - unit2.dot(after2) * unit2)
    compliance = bend_compliance(ni, c, i)
    inverse = 1.0 / (w1 + w2 + compliance)
    l_at = place(ni, rod, Section.MULTIPLIERS, 3 * (step * (n - 2) + i))
    d_l_at = place(ni, rod, Section.D_MULTIPLIERS, 3 * i)
    multiplier = load3(w, l_at) - dl
    store(w, l_at, multiplier)
    d_multiplier = load3(w, d_l_at)
    d_dl = d_multiplier + w2 * relative_imaginary(q1, p2) - w1 * relative_imaginary(q2, p1)
    d_value = -inverse * d_dl
    store(w, d_l_at, d_multiplier + compliance * d_value)
    store(w, q_at, p1 - w2 * times_vector(p2, dl) - times_vector(q2, d_value))
    store(w, q_at + 4, p2 + w1 * times_vector(p1, dl) + times_vector(q1, d_value))
    d_denominator = -inverse * dl.dot(d_dl)
    d_inertia = (w1 + w2) * d_denominator + w1 * pull1.dot(p1) + w2 * pull2.dot(p2)
    d_compliance = d_denominator + d_value.dot(multiplier)
    return d_inertia / c.inertia, d_compliance * compliance / c.bending


@ti.func
def correct_contact(ni: ti.template(), w: ti.template(), c, rod, step, slot, sweep, k):
    """Collision constraint (x - entry) . normal >= 0, whose multiplier never pulls."""
    n = ni[Header.NODES]
    limit = ni[Header.CONTACT_LIMIT]
    stored = ti.select(ni[Header.TAPED] > 0, step, 0)
    contact = place(ni, rod, Section.CONTACTS, CONTACT_WIDTH * (stored * limit + k))
    i = ti.cast(w[contact], ti.i32)
    x_at = place(ni, rod, Section.POSITIONS, 3 * (slot * n + i))
    l_at = place(ni, rod, Section.CONTACT_MULTIPLIERS, stored * limit + k)
    x, normal = load3(w, x_at), load3(w, contact + 7)
    value = (x - load3(w, contact + 4)).dot(normal)
    unclamped = -(value + c.contact * w[l_at]) / (c.mass + c.contact)
    bound = ti.select(unclamped < -w[l_at], 1.0, 0.0)
    dl = ti.max(unclamped, -w[l_at])
    w[l_at] = w[l_at] + dl
    store(w, x_at, x + c.mass * dl * normal)
    tape = place(ni, rod, Section.CONTACT_TAPE, CONTACT_TAPE_WIDTH * (sweep * limit + k))
    store(w, tape, x)
    w[tape + 3] = dl
    w[tape + 4] = bound


@ti.func
def correct_contact_adjoint(ni: ti.template(), w: ti.template(), c, rod, step, sweep, k):
    """Return the derivative with respect to the inverse mass."""
    limit = ni[Header.CONTACT_LIMIT]
    contact = place(ni, rod, Section.CONTACTS, CONTACT_WIDTH * (step * limit + k))
    tape = place(ni, rod, Section.CONTACT_TAPE, CONTACT_TAPE_WIDTH * (sweep * limit + k))
    x, dl, free = load3(w, tape), w[tape + 3], 1.0 - w[tape + 4]
    x_at = place(ni, rod, Section.D_NODES, 3 * ti.cast(w[contact], ti.i32))
    l_at = place(ni, rod, Section.D_CONTACT_MULTIPLIERS, k)
    d_x, normal = load3(w, x_at), load3(w, contact + 7)
    inverse = 1.0 / (c.mass + c.contact)
    d_dl = w[l_at] + c.mass * normal.dot(d_x)
    d_value = -free * inverse * d_dl
    # At its bound the multiplier becomes zero whatever it was.
    w[l_at] = free * (w[l_at] + c.contact * d_value) - (1.0 - free) * (d_dl - w[l_at])
    store(w, x_at, d_x + d_value * normal)
    d_normal = c.mass * dl * d_x + d_value * (x - load3(w, contact + 4))
    add(w, place(ni, rod, Section.D_NORMALS, 3 * k), d_normal)
    return dl * normal.dot(d_x) - free * inverse * dl * d_dl
