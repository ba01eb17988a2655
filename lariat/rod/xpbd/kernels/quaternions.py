"""Products of quaternions (wxyz) that the constraints and their derivatives are made of.

With u a vector, (0, u) the quaternion without real part, and Im the vector part.
"""

import taichi as ti

from lariat.rod.xpbd.launch.layout import Section


@ti.func
def scalar(ni: ti.template(), w: ti.template(), rod, k):
    return w[rod + ni[Section.SCALARS] + k]


@ti.func
def place(ni: ti.template(), rod, section, index):
    return rod + ni[section] + index


@ti.func
def imaginary(q):
    return ti.Vector([q[1], q[2], q[3]])


@ti.func
def director(q):
    """R(q) e3 of (4)."""
    return ti.Vector(
        [
            2.0 * (q[1] * q[3] + q[0] * q[2]),
            2.0 * (q[2] * q[3] - q[0] * q[1]),
            q[0] * q[0] - q[1] * q[1] - q[2] * q[2] + q[3] * q[3],
        ]
    )


@ti.func
def director_slope(q, p):
    """Change of R(q) e3 with a change p of q: (6) as a matrix of 3 by 4, times p."""
    return 2.0 * ti.Vector(
        [
            q[2] * p[0] + q[3] * p[1] + q[0] * p[2] + q[1] * p[3],
            -q[1] * p[0] - q[0] * p[1] + q[3] * p[2] + q[2] * p[3],
            q[0] * p[0] - q[1] * p[1] - q[2] * p[2] + q[3] * p[3],
        ]
    )


@ti.func
def director_pull(q, u):
    """The transpose of that, times u; symmetric in its use: pull(q, u) . p = pull(p, u) . q."""
    return 2.0 * ti.Vector(
        [
            q[2] * u[0] - q[1] * u[1] + q[0] * u[2],
            q[3] * u[0] - q[0] * u[1] - q[1] * u[2],
            q[0] * u[0] + q[3] * u[1] - q[2] * u[2],
            q[1] * u[0] + q[2] * u[1] + q[3] * u[2],
        ]
    )


@ti.func
def between(a, b):
    """Im(conj(a) b)."""
    u, v = imaginary(a), imaginary(b)
    return a[0] * v - b[0] * u - u.cross(v)


@ti.func
def turned_by(a, b):
    """Im(b conj(a))."""
    u, v = imaginary(a), imaginary(b)
    return a[0] * v - b[0] * u + u.cross(v)


@ti.func
def times(a, u):
    """a (0, u)."""
    v = imaginary(a)
    w = a[0] * u + v.cross(u)
    return ti.Vector([-v.dot(u), w[0], w[1], w[2]])


@ti.func
def led(u, a):
    """(0, u) a."""
    v = imaginary(a)
    w = a[0] * u + u.cross(v)
    return ti.Vector([-u.dot(v), w[0], w[1], w[2]])
