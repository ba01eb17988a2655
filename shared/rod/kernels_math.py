# type: ignore
"""Rotations inside kernels; conventions as in `shared.geometry.poses`.

Without branches, as everything that is inlined here must be: see `kernels`. Nowhere is there
`w[i] += v`, which Taichi makes an atomic addition of, with a lock for every number.
"""

import taichi as ti


@ti.func
def load3(w: ti.template(), at):
    return ti.Vector([w[at], w[at + 1], w[at + 2]])


@ti.func
def store3(w: ti.template(), at, v):
    for a in ti.static(range(3)):
        w[at + a] = v[a]


@ti.func
def add3(w: ti.template(), at, v):
    for a in ti.static(range(3)):
        w[at + a] = w[at + a] + v[a]


@ti.func
def load4(w: ti.template(), at):
    return ti.Vector([w[at], w[at + 1], w[at + 2], w[at + 3]])


@ti.func
def store4(w: ti.template(), at, v):
    for a in ti.static(range(4)):
        w[at + a] = v[a]


@ti.func
def load33(w: ti.template(), at):
    return ti.Matrix(
        [
            [w[at], w[at + 1], w[at + 2]],
            [w[at + 3], w[at + 4], w[at + 5]],
            [w[at + 6], w[at + 7], w[at + 8]],
        ]
    )


@ti.func
def store33(w: ti.template(), at, m):
    for a in ti.static(range(3)):
        for b in ti.static(range(3)):
            w[at + 3 * a + b] = m[a, b]


@ti.func
def add33(w: ti.template(), at, m):
    for a in ti.static(range(3)):
        for b in ti.static(range(3)):
            w[at + 3 * a + b] = w[at + 3 * a + b] + m[a, b]


@ti.func
def cross_matrix(v):
    """[v]x, so that [v]x a = v x a."""
    return ti.Matrix([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])


@ti.func
def quaternion_product(a, b):
    return ti.Vector(
        [
            a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
            a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
            a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
            a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
        ]
    )


@ti.func
def relative(a, b):
    """conj(a) b on the short way round."""
    u = quaternion_product(ti.Vector([a[0], -a[1], -a[2], -a[3]]), b)
    return ti.select(u[0] < 0.0, -1.0, 1.0) * u


@ti.func
def rotation_matrix(q):
    w, x, y, z = q[0], q[1], q[2], q[3]
    return ti.Matrix(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


@ti.func
def turned(q, phi):
    """q after a small rotation `phi` in its own frame; exp(phi) to second order, and cheaper."""
    p = quaternion_product(q, ti.Vector([1.0, 0.5 * phi[0], 0.5 * phi[1], 0.5 * phi[2]]))
    return p / ti.sqrt(p.dot(p))


@ti.func
def exponential(y):
    """Unit quaternion of a rotation vector."""
    t2 = y.dot(y)
    t = ti.sqrt(ti.max(t2, 1e-6))
    small = t2 < 1e-6
    s = ti.select(small, 0.5 - t2 / 48.0, ti.sin(0.5 * t) / t)
    c = ti.select(small, 1.0 - t2 / 8.0, ti.cos(0.5 * t))
    return ti.Vector([c, s * y[0], s * y[1], s * y[2]])


@ti.func
def logarithm(u):
    """Rotation vector of a unit quaternion with u[0] >= 0.

    Its angle is 8 atan(x) with x = tan(angle / 8) < 0.4143, where a polynomial in x^2 is exact to
    rounding: the library's arcus tangent took a fifth of the time of a whole roll-out.
    """
    v = ti.Vector([u[1], u[2], u[3]])
    s2 = v.dot(v)
    # tan(angle / 4) = |v| half, then halved once more.
    half = 1.0 / (u[0] + ti.sqrt(u[0] * u[0] + s2))
    t2 = s2 * half * half
    quarter = 1.0 / (1.0 + ti.sqrt(1.0 + t2))
    x = t2 * quarter * quarter
    x2 = x * x
    x4 = x2 * x2
    low = (1.0 - 0.33333333333328435 * x) + x2 * (0.19999999998854168 - 0.14285714180900647 * x)
    middle = (0.11111106177375227 - 0.09090773003240828 * x) + x2 * (
        0.07689952488233016 - 0.066402251735395 * x
    )
    high = (0.0568830340363325 - 0.04347919839046537 * x) + x2 * 0.021133752033748364
    return (8.0 * half * quarter * (low + x4 * (middle + x4 * high))) * v


@ti.func
def log_coefficients(t2, u):
    """c and c'/t of J_l^-1(y) = I - [y]x / 2 + c [y]x^2, where y = log(u) and t = |y|.

    c = (1 - (t/2) cot(t/2)) / t^2. Series where the closed form cancels.
    """
    c = 1 / 12 + t2 * (1 / 720 + t2 * (1 / 30240 + t2 * (1 / 1209600 + t2 / 47900160)))
    d = 1 / 360 + t2 * (
        1 / 7560 + t2 * (1 / 201600 + t2 * (1 / 5987520 + t2 * 5.284190138687493e-9))
    )
    large = t2 > 0.04
    far = ti.max(t2, 0.04)
    t = ti.sqrt(far)
    s2 = ti.max(1.0 - u[0] * u[0], 1e-4)
    s = ti.sqrt(s2)
    cot = u[0] / s
    closed_c = (1.0 - 0.5 * t * cot) / far
    closed_d = (-2.0 / (far * t) + 0.5 * cot / far + 0.25 / (t * s2)) / t
    return ti.select(large, closed_c, c), ti.select(large, closed_d, d)


@ti.func
def left_jacobian_inverse(y, c):
    """J_l^-1(y), with c of `log_coefficients`; its transpose is the right one."""
    k = cross_matrix(y)
    return ti.Matrix.identity(ti.f64, 3) - 0.5 * k + c * (k @ k)


@ti.func
def left_jacobian(y):
    """J_l(y): exp(y + dy) = exp(J_l(y) dy) exp(y); its transpose is the right one."""
    t2 = y.dot(y)
    t = ti.sqrt(ti.max(t2, 1e-4))
    small = t2 < 1e-4
    a = ti.select(small, 0.5 + t2 * (-1 / 24 + t2 / 720), (1.0 - ti.cos(t)) / (t * t))
    b = ti.select(small, 1 / 6 + t2 * (-1 / 120 + t2 / 5040), (t - ti.sin(t)) / (t * t * t))
    k = cross_matrix(y)
    return ti.Matrix.identity(ti.f64, 3) + a * k + b * (k @ k)
