"""Where nodes enter obstacles: the planes of the collision constraint, and their slopes.

The way of a node is the ray from where it was to where it would go. Obstacles are convex, and so is
the signed distance along a line: Newton's method from the start of the ray finds the first entry,
never past it, and a slope that is not negative says that there is none.
"""

import taichi as ti

from lariat.rod.kernels.memory import add, load3, store
from lariat.rod.launch.layout import OBSTACLE_WIDTH
from lariat.rod.xpbd.kernels.quaternions import place, scalar
from lariat.rod.xpbd.launch.layout import CONTACT_WIDTH, CONTACTS_PER_NODE, Header, Scalar, Section

CLOSE = 1e-13
"""Distance from the surface that counts as on it [m]."""
GRAZING = 1e-12
"""Approach over a whole step that is none [m]."""
STEPS = 30


@ti.func
def surface(w: ti.template(), row, point):
    """Signed distance, its slope and its second derivative, in the world frame."""
    turn = ti.Matrix(
        [
            [w[row + 4], w[row + 5], w[row + 6]],
            [w[row + 7], w[row + 8], w[row + 9]],
            [w[row + 10], w[row + 11], w[row + 12]],
        ]
    )
    shape = ti.cast(w[row], ti.i32)
    p = turn.transpose() @ (point - load3(w, row + 1))
    size = load3(w, row + 13)
    distance = 0.0
    normal = ti.Vector([0.0, 0.0, 1.0])
    second = ti.Matrix.zero(ti.f64, 3, 3)
    if shape == 0:  # cylinder
        rho = ti.sqrt(p[0] * p[0] + p[1] * p[1]) + 1e-15
        side = ti.select(p[2] < 0.0, -1.0, 1.0)
        radial = ti.Vector([p[0] / rho, p[1] / rho, 0.0])
        around = ti.Vector([-p[1] / rho, p[0] / rho, 0.0])
        axial = ti.Vector([0.0, 0.0, side])
        a = rho - size[0]
        b = ti.abs(p[2]) - size[1]
        if a > 0.0 and b > 0.0:
            distance = ti.sqrt(a * a + b * b)
            normal = (a * radial + b * axial) / distance
            over = (b * radial - a * axial) / distance
            second = (a / (distance * rho)) * around.outer_product(around)
            second += over.outer_product(over) / distance
        elif a > b:
            distance = a
            normal = radial
            second = around.outer_product(around) / rho
        else:
            distance = b
            normal = axial
    elif shape == 1:  # box
        out = ti.Vector([0.0, 0.0, 0.0])
        active = ti.Vector([0.0, 0.0, 0.0])
        deepest = -1e30
        face = ti.Vector([0.0, 0.0, 1.0])
        for c in ti.static(range(3)):
            excess = ti.abs(p[c]) - size[c]
            side = ti.select(p[c] < 0.0, -1.0, 1.0)
            if excess > 0.0:
                out[c] = side * excess
                active[c] = 1.0
            if excess > deepest:
                deepest = excess
                face = ti.Vector([0.0, 0.0, 0.0])
                face[c] = side
        if deepest > 0.0:
            distance = out.norm()
            normal = out / distance
            second = -normal.outer_product(normal)
            for c in ti.static(range(3)):
                second[c, c] += active[c]
            second /= distance
        else:
            distance = deepest
            normal = face
    elif shape == 4:  # half space
        normal = size
        distance = p.dot(normal)
    else:  # sphere, capsule
        half = ti.select(shape == 3, size[1], 0.0)
        off = p - ti.Vector([0.0, 0.0, ti.min(ti.max(p[2], -half), half)])
        rho = off.norm() + 1e-15
        distance = rho - size[0]
        normal = off / rho
        second = ti.Matrix.identity(ti.f64, 3) - normal.outer_product(normal)
        if shape == 3 and ti.abs(p[2]) < half:
            second[2, 2] -= 1.0
        second /= rho
    return distance, turn @ normal, turn @ second @ turn.transpose()


@ti.func
def collide(ni: ti.template(), w: ti.template(), rod, step, slot):
    """Lists the planes that nodes run into on their way from slot - 1 to slot."""
    n = ni[Header.NODES]
    limit = ni[Header.CONTACT_LIMIT]
    radius = scalar(ni, w, rod, Scalar.RADIUS)
    kept = ti.select(ni[Header.TAPED] > 0, step, 0)
    count = 0
    for i in range(ni[Header.FIRST_NODE], ni[Header.END_NODE]):
        start = load3(w, place(ni, rod, Section.POSITIONS, 3 * ((slot - 1) * n + i)))
        stop = load3(w, place(ni, rod, Section.POSITIONS, 3 * (slot * n + i)))
        way = stop - start
        found = 0
        for o in range(ni[Header.OBSTACLES]):
            row = ni[Header.OBSTACLE_ROWS] + OBSTACLE_WIDTH * o
            reach = w[row + 16] + radius + way.norm()
            # 0 outside and going on, 1 entered, 2 inside all along, 3 nothing to do.
            status = ti.select((start - load3(w, row + 1)).norm() < reach, 0, 3)
            share = 0.0
            point = start
            normal = ti.Vector([0.0, 0.0, 1.0])
            for k in range(STEPS):
                if status == 0:
                    distance, slope, _second = surface(w, row, point)
                    distance -= radius
                    approach = slope.dot(way)
                    normal = slope
                    if k == 0 and distance < -CLOSE:
                        point = start - distance * slope
                        status = 2
                    elif distance < CLOSE:
                        status = ti.select(approach < -GRAZING, 1, 3)
                    elif approach > -GRAZING:
                        status = 3
                    else:
                        share -= distance / approach
                        point = start + share * way
                        if share > 1.0:
                            status = 3
            if status == 2:
                beyond, _slope, _second = surface(w, row, stop)
                if beyond > radius:
                    status = 3
            if (status == 1 or status == 2) and found < CONTACTS_PER_NODE:
                contact = place(ni, rod, Section.CONTACTS, CONTACT_WIDTH * (kept * limit + count))
                w[contact] = i
                w[contact + 1] = row
                w[contact + 2] = ti.select(status == 1, 1.0, 0.0)
                w[contact + 3] = share
                store(w, contact + 4, point)
                store(w, contact + 7, normal)
                store(w, contact + 10, stop)
                w[place(ni, rod, Section.CONTACT_MULTIPLIERS, kept * limit + count)] = 0.0
                found += 1
                count += 1
    w[place(ni, rod, Section.CONTACT_COUNTS, kept)] = count


@ti.func
def collide_adjoint(ni: ti.template(), w: ti.template(), rod, step, count):
    """What the slopes in the planes mean for both ends of the ways.

    C does not change as the point slides in its plane, and the point never leaves the surface: only
    the normal's slope counts.
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
        _distance, _slope, second = surface(w, row, point)
        d_point = second @ d_normal
        if w[contact + 2] > 0.5:
            normal = load3(w, contact + 7)
            way = load3(w, contact + 10) - start
            d_point -= (way.dot(d_point) / way.dot(normal)) * normal
        add(w, place(ni, rod, Section.D_POSITIONS, 3 * i), (1.0 - share) * d_point)
        add(w, place(ni, rod, Section.D_NODES, 3 * i), share * d_point)
