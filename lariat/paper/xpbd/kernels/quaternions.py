"""Products of quaternions (wxyz) in the constraints and their derivatives.

u is a vector, (0, u) the quaternion with zero real part and vector part u, Im(q) the vector part.
"""

from lariat.kernel_cache.language import ti


@ti.func
def imaginary(q):
    """Im(q)."""
    return ti.Vector([q[1], q[2], q[3]])


@ti.func
def director(q):
    """Third axis of an edge, R(q) e3 of (4)."""
    return ti.Vector(
        [
            2.0 * (q[1] * q[3] + q[0] * q[2]),
            2.0 * (q[2] * q[3] - q[0] * q[1]),
            q[0] * q[0] - q[1] * q[1] - q[2] * q[2] + q[3] * q[3],
        ]
    )


@ti.func
def director_derivative(q, p):
    """Derivative of R(q) e3 along p: the 3x4 matrix (6) times p."""
    return 2.0 * ti.Vector(
        [
            q[2] * p[0] + q[3] * p[1] + q[0] * p[2] + q[1] * p[3],
            -q[1] * p[0] - q[0] * p[1] + q[3] * p[2] + q[2] * p[3],
            q[0] * p[0] - q[1] * p[1] - q[2] * p[2] + q[3] * p[3],
        ]
    )


@ti.func
def director_transpose(q, u):
    """Transpose of (6) times u; f(q, u) . p = f(p, u) . q."""
    return 2.0 * ti.Vector(
        [
            q[2] * u[0] - q[1] * u[1] + q[0] * u[2],
            q[3] * u[0] - q[0] * u[1] - q[1] * u[2],
            q[0] * u[0] + q[3] * u[1] - q[2] * u[2],
            q[1] * u[0] + q[2] * u[1] + q[3] * u[2],
        ]
    )


@ti.func
def relative_imaginary(a, b):
    """Im(conj(a) b)."""
    u, v = imaginary(a), imaginary(b)
    return a[0] * v - b[0] * u - u.cross(v)


@ti.func
def rotation_imaginary(a, b):
    """Im(b conj(a))."""
    u, v = imaginary(a), imaginary(b)
    return a[0] * v - b[0] * u + u.cross(v)


@ti.func
def times_vector(a, u):
    """a (0, u)."""
    v = imaginary(a)
    w = a[0] * u + v.cross(u)
    return ti.Vector([-v.dot(u), w[0], w[1], w[2]])


@ti.func
def vector_times(u, a):
    """(0, u) a."""
    v = imaginary(a)
    w = a[0] * u + u.cross(v)
    return ti.Vector([-u.dot(v), w[0], w[1], w[2]])
