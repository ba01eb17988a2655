"""Contacts of nodes with obstacles: the planes of the collision constraint, and their derivatives.

A node moves on a ray from its last position to the one that it would take. Obstacles are convex,
and so is the signed distance along the ray: Newton's method from the start of the ray finds the
first entry and never passes it. There is no entry where the derivative along the ray is not
negative.
"""

from lariat.kernel_cache.language import ti
from lariat.paper.xpbd.kernels.addressing import place, scalar
from lariat.paper.xpbd.launch.layout import (
    CONTACT_WIDTH,
    CONTACTS_PER_NODE,
    Header,
    Scalar,
    Section,
)
from lariat.rod.kernels.memory import add, load3, store
from lariat.rod.kernels.signed_distance import signed_distance
from lariat.rod.launch.layout import OBSTACLE_WIDTH, ObstacleRow

SURFACE_TOLERANCE = 1e-13
"""Distance from the surface below which a point lies on it [m]."""
MIN_APPROACH = 1e-12
"""Decrease of the distance over the whole ray below which it counts as none [m]."""
MAX_NEWTON_STEPS = 30
"""Largest number of Newton steps along a ray."""


@ti.func
def find_contacts(ni: ti.template(), w: ti.template(), rod, step, slot):
    """List the planes that nodes run into between slot - 1 and slot."""
    n = ni[Header.NODES]
    limit = ni[Header.CONTACT_LIMIT]
    radius = scalar(ni, w, rod, Scalar.RADIUS)
    stored = ti.select(ni[Header.TAPED] > 0, step, 0)
    count = 0
    for i in range(ni[Header.FIRST_NODE], ni[Header.END_NODE]):
        start = load3(w, place(ni, rod, Section.POSITIONS, 3 * ((slot - 1) * n + i)))
        stop = load3(w, place(ni, rod, Section.POSITIONS, 3 * (slot * n + i)))
        ray = stop - start
        contact_count = 0
        for o in range(ni[Header.OBSTACLES]):
            row = ni[Header.OBSTACLE_ROWS] + OBSTACLE_WIDTH * o
            reach = w[row + ObstacleRow.BOUNDING_RADIUS] + radius + ray.norm()
            # 0: outside and approaching, 1: entered, 2: inside from the start, 3: no contact.
            status = ti.select((start - load3(w, row + ObstacleRow.POSITION)).norm() < reach, 0, 3)
            share = 0.0
            point = start
            normal = ti.Vector([0.0, 0.0, 1.0])
            for k in range(MAX_NEWTON_STEPS):
                if status == 0:
                    distance, gradient, _hessian = signed_distance(w, row, point)
                    distance -= radius
                    approach = gradient.dot(ray)
                    normal = gradient
                    if k == 0 and distance < -SURFACE_TOLERANCE:
                        point = start - distance * gradient
                        status = 2
                    elif distance < SURFACE_TOLERANCE:
                        status = ti.select(approach < -MIN_APPROACH, 1, 3)
                    elif approach > -MIN_APPROACH:
                        status = 3
                    else:
                        share -= distance / approach
                        point = start + share * ray
                        if share > 1.0:
                            status = 3
            if status == 2:
                beyond, _gradient, _hessian = signed_distance(w, row, stop)
                if beyond > radius:
                    status = 3
            if (status == 1 or status == 2) and contact_count < CONTACTS_PER_NODE:
                contact = place(ni, rod, Section.CONTACTS, CONTACT_WIDTH * (stored * limit + count))
                w[contact] = i
                w[contact + 1] = row
                w[contact + 2] = ti.select(status == 1, 1.0, 0.0)
                w[contact + 3] = share
                store(w, contact + 4, point)
                store(w, contact + 7, normal)
                store(w, contact + 10, stop)
                w[place(ni, rod, Section.CONTACT_MULTIPLIERS, stored * limit + count)] = 0.0
                contact_count += 1
                count += 1
    w[place(ni, rod, Section.CONTACT_COUNTS, stored)] = count


@ti.func
def find_contacts_adjoint(ni: ti.template(), w: ti.template(), rod, step, count):
    """Carry derivatives with respect to the planes on to both ends of the rays.

    The constraint does not change as the entry slides in its plane, and the entry never leaves the
    surface: only the derivative with respect to the normal counts.
    """
    n = ni[Header.NODES]
    limit = ni[Header.CONTACT_LIMIT]
    for k in range(count):
        contact = place(ni, rod, Section.CONTACTS, CONTACT_WIDTH * (step * limit + k))
        i = ti.cast(w[contact], ti.i32)
        row = ti.cast(w[contact + 1], ti.i32)
        share = w[contact + 3]
        start = load3(w, place(ni, rod, Section.POSITIONS, 3 * (step * n + i)))
        d_normal = load3(w, place(ni, rod, Section.D_NORMALS, 3 * k))
        point = start
        if w[contact + 2] > 0.5:
            point = load3(w, contact + 4)
        _distance, _gradient, hessian = signed_distance(w, row, point)
        d_point = hessian @ d_normal
        if w[contact + 2] > 0.5:
            normal = load3(w, contact + 7)
            ray = load3(w, contact + 10) - start
            d_point -= (ray.dot(d_point) / ray.dot(normal)) * normal
        add(w, place(ni, rod, Section.D_POSITIONS, 3 * i), (1.0 - share) * d_point)
        add(w, place(ni, rod, Section.D_NODES, 3 * i), share * d_point)
