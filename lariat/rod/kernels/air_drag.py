"""Drag of the air across the rod, which grows with the square of the speed.

Each end of an edge carries half of the edge. With the velocity v of that node, the axis t of the
edge after the last solve, drag coefficient C, density of the air rho, diameter d, edge length l,

    (A)  sum over edges and their ends  h k |u|^3 / 3,   u = v - (v t) t,   k = C rho d l / 4,

so that the force is -k |u| u. The axis is that of the last solve: with the present one, the edge
would be turned as well.
"""

from lariat.kernel_cache.language import ti
from lariat.rod.kernels.addressing import (
    hessian_at,
    orientation_at,
    parameter_code_at,
    position_at,
    scalar,
    time_at,
)
from lariat.rod.kernels.memory import (
    add,
    add33,
    bounded,
    load3,
    load4,
    load_column,
    store_column,
)
from lariat.rod.kernels.rotations import rotation_matrix
from lariat.rod.kernels.step_terms import add_parameter_derivative
from lariat.rod.kernels.types import Doubles, Integers
from lariat.rod.launch.codes import HessianPart
from lariat.rod.launch.layout import (
    COLUMNS_STRIDE,
    COLUMNS_WIDTH,
    GROUP_COLUMNS,
    HISTORY_SLOTS,
    Header,
    ParameterCode,
    Scalar,
    Section,
    TimeRow,
)


@ti.func
def has_air_drag(ni: ti.template(), w: ti.template(), rod):
    """Whether the air slows the rod."""
    return scalar(ni, w, rod, Scalar.DRAG_COEFFICIENT) > 0.0


@ti.func
def drag_per_coefficient(ni: ti.template(), w: ti.template(), rod):
    """Force on an end of an edge per squared speed and drag coefficient [kg/m]."""
    radius = scalar(ni, w, rod, Scalar.CONTACT_REACH) - scalar(ni, w, rod, Scalar.CONTACT_MARGIN)
    area = radius * scalar(ni, w, rod, Scalar.EDGE_LENGTH)
    return 0.5 * area * scalar(ni, w, rod, Scalar.AIR_DENSITY)


@ti.func
def edge_frame(ni: ti.template(), w: ti.template(), rod, step, edge):
    """Rotation matrix of an edge after the last solve."""
    return rotation_matrix(load4(w, orientation_at(ni, rod, step + HISTORY_SLOTS - 1, edge)))


@ti.func
def base_share(ni: ti.template(), w: ti.template(), rod, step, back):
    """Share of an earlier solve in the base of the velocity."""
    return w[time_at(ni, rod, step) + TimeRow.BASE_SHARES + back - 1]


@ti.func
def velocity(ni: ti.template(), w: ti.template(), rod, step, node):
    """Velocity of a node [m/s]; zero in a solve without velocity."""
    v = load3(w, position_at(ni, rod, step + HISTORY_SLOTS, node))
    for back in ti.static(range(1, 3)):
        before = load3(w, position_at(ni, rod, step + HISTORY_SLOTS - back, node))
        v -= base_share(ni, w, rod, step, back) * before
    start = time_at(ni, rod, step)
    return (w[start + TimeRow.KEEPS_VELOCITY] / w[start]) * v


@ti.func
def crossflow(v, axis):
    """Part of a velocity across an axis, and its norm, which is never quite zero [m/s]."""
    u = v - v.dot(axis) * axis
    return u, ti.sqrt(u.dot(u)) + 1e-300


@ti.func
def stiffness_of(u, speed, axis):
    """Derivative of |u| u with respect to the velocity [m/s]."""
    m = u.outer_product(u) / speed - speed * axis.outer_product(axis)
    for a in ti.static(range(3)):
        m[a, a] += speed
    return m


@ti.func
def turn_derivative(v, u, speed, frame):
    """Derivative of |u| u with respect to rotations of the edge in its own frame [m^2/s^2]."""
    axis = ti.Vector([frame[0, 2], frame[1, 2], frame[2, 2]])
    along = v.dot(axis)
    by_axis = -along / speed * u.outer_product(u) - speed * axis.outer_product(v)
    for a in ti.static(range(3)):
        by_axis[a, a] -= along * speed
    # A rotation phi moves the axis by R (phi x z).
    m = by_axis @ frame
    return ti.Matrix([[-m[0, 1], m[0, 0], 0.0], [-m[1, 1], m[1, 0], 0.0], [-m[2, 1], m[2, 0], 0.0]])


@ti.real_func
def air_drag_energy(ni: Integers, w: Doubles, rod: ti.i32, step: ti.i32, part: ti.i32) -> ti.f64:
    """Add energy, gradient and Hessian of the drag, eq. (A); all of the Hessian is semidefinite."""
    energy = 0.0
    h = w[time_at(ni, rod, step)]
    k = scalar(ni, w, rod, Scalar.DRAG_COEFFICIENT) * drag_per_coefficient(ni, w, rod)
    for e in range(ni[Header.FIRST_EDGE], ni[Header.END_EDGE]):
        frame = edge_frame(ni, w, rod, step, e)
        axis = ti.Vector([frame[0, 2], frame[1, 2], frame[2, 2]])
        for i in range(e, e + 2):
            u, speed = crossflow(velocity(ni, w, rod, step, i), axis)
            energy += h * k * speed * speed * speed / 3.0
            add(w, rod + ni[Section.GRADIENT] + 6 * i, k * speed * u)
            if part != HessianPart.NONE:
                m = (k / h) * stiffness_of(u, speed, axis)
                add33(w, hessian_at(ni, rod, step, 2 * i), m)
    return energy


@ti.real_func
def air_drag_parameter_derivatives(ni: Integers, w: Doubles, rod: ti.i32, step: ti.i32) -> ti.i32:
    """Add the drag to the derivatives in its coefficient and in the length of the rod."""
    coefficient = scalar(ni, w, rod, Scalar.DRAG_COEFFICIENT)
    unit = drag_per_coefficient(ni, w, rod)
    edges = ni[Header.END_EDGE] - ni[Header.FIRST_EDGE]
    length = edges * scalar(ni, w, rod, Scalar.EDGE_LENGTH)
    for p in range(ni[Header.PARAMETERS]):
        code = ni[parameter_code_at(ni, p)]
        k = 0.0
        if code == ParameterCode.DRAG_COEFFICIENT:
            k = unit
        elif code == ParameterCode.LENGTH:
            k = coefficient * unit / length
        for e in range(ni[Header.FIRST_EDGE], ni[Header.END_EDGE]):
            if k > 0.0:
                frame = edge_frame(ni, w, rod, step, e)
                axis = ti.Vector([frame[0, 2], frame[1, 2], frame[2, 2]])
                for i in range(e, e + 2):
                    u, speed = crossflow(velocity(ni, w, rod, step, i), axis)
                    add_parameter_derivative(ni, w, rod, p, 2 * i, k * speed * u)
    return 0


@ti.real_func
def air_drag_sensitivities(
    ni: Integers, w: Doubles, rod: ti.i32, step: ti.i32, start: ti.i32, history: ti.i32
) -> ti.i32:
    """Subtract from a group of columns what the drag takes over from the solves before.

    Args:
        start: Offset of the columns.
        history: Number of solves before this one that they depend on.
    """
    h = w[time_at(ni, rod, step)]
    k = scalar(ni, w, rod, Scalar.DRAG_COEFFICIENT) * drag_per_coefficient(ni, w, rod)
    for e in range(ni[Header.FIRST_EDGE], ni[Header.END_EDGE]):
        frame = edge_frame(ni, w, rod, step, e)
        axis = ti.Vector([frame[0, 2], frame[1, 2], frame[2, 2]])
        for i in range(e, e + 2):
            if 2 * i >= ni[Header.FIRST_FREE] and 2 * i < ni[Header.END_FREE]:
                v = velocity(ni, w, rod, step, i)
                u, speed = crossflow(v, axis)
                at = bounded(start + COLUMNS_STRIDE * 2 * i)
                for back in range(1, ti.min(history, 2) + 1):
                    share = base_share(ni, w, rod, step, back)
                    m = (share * k / h) * stiffness_of(u, speed, axis)
                    for c in range(GROUP_COLUMNS):
                        taken = m @ load_column(w, at + COLUMNS_WIDTH * back + c)
                        store_column(w, at + c, load_column(w, at + c) + taken)
                if history > 0:
                    m = k * turn_derivative(v, u, speed, frame)
                    turned = bounded(start + COLUMNS_STRIDE * (2 * e + 1) + COLUMNS_WIDTH)
                    for c in range(GROUP_COLUMNS):
                        taken = m @ load_column(w, turned + c)
                        store_column(w, at + c, load_column(w, at + c) - taken)
    return 0


@ti.real_func
def air_drag_adjoint(ni: Integers, w: Doubles, rod: ti.i32, step: ti.i32) -> ti.i32:
    """Carry the adjoint of a solve over the drag to the solves before it."""
    count = 2 * ni[Header.NODES] - 1
    new = rod + ni[Section.ADJOINT] + 3 * count * (step + HISTORY_SLOTS)
    h = w[time_at(ni, rod, step)]
    k = scalar(ni, w, rod, Scalar.DRAG_COEFFICIENT) * drag_per_coefficient(ni, w, rod)
    for e in range(ni[Header.FIRST_EDGE], ni[Header.END_EDGE]):
        frame = edge_frame(ni, w, rod, step, e)
        axis = ti.Vector([frame[0, 2], frame[1, 2], frame[2, 2]])
        for i in range(e, e + 2):
            if 2 * i >= ni[Header.FIRST_FREE] and 2 * i < ni[Header.END_FREE]:
                v = velocity(ni, w, rod, step, i)
                u, speed = crossflow(v, axis)
                pull = k * load3(w, new + 6 * i)
                for back in range(1, 3):
                    share = base_share(ni, w, rod, step, back) / h
                    old = new - 3 * count * back + 6 * i
                    add(w, old, share * (stiffness_of(u, speed, axis) @ pull))
                turned = turn_derivative(v, u, speed, frame).transpose() @ pull
                add(w, new - 3 * count + 6 * e + 3, -turned)
    return 0
