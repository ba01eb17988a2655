"""Rotations: quaternions (wxyz), rotation vectors, and the Jacobians of SO(3).

Conventions are those of `lariat.geometry.poses`. The functions have no branches, since they are
inlined into real functions (see the package).
"""

from math import factorial, pi

from lariat.kernel_cache.language import ti

LOG_FACTOR, JACOBIAN_COEFFICIENT, JACOBIAN_COEFFICIENT_DERIVATIVE, SINE, COSINE = range(5)
"""Places of the polynomials in `POLYNOMIALS`."""
# fmt: off
POLYNOMIALS = (
    # log(u) = LOG_FACTOR Im(u): t / sin(t / 2)
    (
        2.0, 0.6666666666669252, 0.2666666666323836, 0.11428571608572231,
        0.05079360093602386, 0.02308886458730117, 0.010646583266642305, 0.005046899599081766,
        0.001915998849504018, 0.002922896249558827, -0.005373022757655533, 0.014995625517545042,
        -0.028303527090735622, 0.04228417309711461, -0.04790428375445948, 0.04088020629449461,
        -0.025371105568824655, 0.010871279959957838, -0.002882615566316569, 0.0003620305855296003,
    ),
    # c of `log_coefficients`
    (
        0.08333333333333333, 0.011111111111114432, 0.00396825396781365, 0.001622574979026938,
        0.0007027945068837536, 0.00031430439214841005, 0.00014331938047718197,
        6.734397467742443e-05, 2.5600892162115942e-05, 3.7939649575344635e-05,
        -6.885210325382492e-05, 0.00019267998779079902, -0.000363529493018898,
        0.0005431622599653166, -0.0006153564673606193, 0.0005251538614860343,
        -0.0003259344991775923, 0.00013966898382363732, -3.703731148977058e-05,
        4.652236360101222e-06,
    ),
    # c'/t of `log_coefficients`
    (
        0.002777777777777776, 0.001058201058202379, 0.0004938271603186931, 0.00023836246977912727,
        0.00011655358149204461, 5.737171241752032e-05, 2.8297169889642786e-05,
        1.4418640073087067e-05, 4.802784701333202e-06, 1.2714597112271104e-05,
        -2.835839979323209e-05, 7.596640105850816e-05, -0.00014428578672184998,
        0.00021501238486147095, -0.00024348446564669387, 0.00020748666208824217,
        -0.0001285963214149807, 5.4990745659375256e-05, -1.4545531400955639e-05,
        1.81876076201023e-06,
    ),
    # sin(x) / x and cos(x), in z = x^2
    tuple((-1) ** k / factorial(2 * k + 1) for k in range(12)),
    tuple((-1) ** k / factorial(2 * k) for k in range(12)),
)
# fmt: on
"""Coefficients of polynomials, lowest order first: the first three in z = 1 - cos(t / 2).

Those are exact to rounding for angles t up to half a turn, where all three functions are smooth in
z up to z = 1. Interpolated at Chebyshev nodes with 60 digits. They replace the arctangent, which
would take a fifth of the time of a roll-out, and roots and quotients, which would take a tenth.
Sine and cosine are exact to rounding for x up to a quarter of a turn.
"""


@ti.func
def cross_matrix(v):
    """[v]x, so that [v]x a = v x a."""
    return ti.Matrix([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])


@ti.func
def quaternion_product(a, b):
    """Hamilton product a b."""
    return ti.Vector(
        [
            a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
            a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
            a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
            a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
        ]
    )


@ti.func
def relative_rotation(a, b):
    """conj(a) b, with the sign that makes its real part positive: the shorter rotation."""
    u = quaternion_product(ti.Vector([a[0], -a[1], -a[2], -a[3]]), b)
    return ti.select(u[0] < 0.0, -1.0, 1.0) * u


@ti.func
def rotation_matrix(q):
    """Rotation matrix of a unit quaternion."""
    w, x, y, z = q[0], q[1], q[2], q[3]
    return ti.Matrix(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


@ti.func
def rotated(q, phi):
    """Rotate q by a small `phi` in its own frame: q exp(phi) to second order, normalized."""
    p = quaternion_product(q, ti.Vector([1.0, 0.5 * phi[0], 0.5 * phi[1], 0.5 * phi[2]]))
    return (1.0 / ti.sqrt(p.dot(p))) * p


@ti.func
def half_angle(t2):
    """sin(t / 2) / t and cos(t / 2) of an angle t, from its square."""
    half = 0.5 * ti.sqrt(t2)
    turns = ti.floor(half * (1.0 / pi) + 0.5)
    x = half - pi * turns
    sign = 1.0 + 4.0 * ti.floor(0.5 * turns) - 2.0 * turns
    s = 0.5 * ti.select(turns == 0.0, 1.0, x / ti.max(half, 1.0))
    sine, cosine = evaluate_polynomial(x * x, SINE), evaluate_polynomial(x * x, COSINE)
    return sign * s * sine, sign * cosine


@ti.func
def exponential(y):
    """Unit quaternion of a rotation vector."""
    s, c = half_angle(y.dot(y))
    return ti.Vector([c, s * y[0], s * y[1], s * y[2]])


@ti.func
def logarithm(u):
    """Rotation vector of a unit quaternion with u[0] >= 0."""
    return evaluate_polynomial(1.0 - u[0], LOG_FACTOR) * ti.Vector([u[1], u[2], u[3]])


@ti.func
def log_coefficients(u):
    """c and c'/t of J_l^-1(y) = I - [y]x / 2 + c [y]x^2, where y = log(u) and t = |y|.

    c = (1 - (t/2) cot(t/2)) / t^2.
    """
    return evaluate_polynomial(1.0 - u[0], JACOBIAN_COEFFICIENT), evaluate_polynomial(
        1.0 - u[0], JACOBIAN_COEFFICIENT_DERIVATIVE
    )


@ti.func
def evaluate_polynomial(z, which: ti.template()):
    """Polynomial `which` at z, as short sums that run in parallel."""
    z2 = z * z
    z4 = z2 * z2
    total = 0.0
    for k in ti.static(range(len(POLYNOMIALS[which]) - 4, -1, -4)):
        low = POLYNOMIALS[which][k] + POLYNOMIALS[which][k + 1] * z
        high = POLYNOMIALS[which][k + 2] + POLYNOMIALS[which][k + 3] * z
        total = total * z4 + (low + z2 * high)
    return total


@ti.func
def left_jacobian_inverse(y, c):
    """J_l^-1(y), with c of `log_coefficients`; its transpose is the right one."""
    # c [y]x^2 = c (y y^T - |y|^2 I): products with zeros are not left out by the compiler.
    inverse = c * y.outer_product(y) - 0.5 * cross_matrix(y)
    diagonal = 1.0 - c * y.dot(y)
    for a in ti.static(range(3)):
        inverse[a, a] += diagonal
    return inverse


@ti.func
def left_jacobian(y):
    """J_l(y): exp(y + dy) = exp(J_l(y) dy) exp(y); its transpose is the right one."""
    t2 = y.dot(y)
    s, c = half_angle(t2)
    series = 1 / 6 + t2 * (-1 / 120 + t2 / 5040)
    b = ti.select(t2 < 1e-4, series, (1.0 - 2.0 * s * c) / ti.max(t2, 1e-4))
    k = cross_matrix(y)
    return ti.Matrix.identity(ti.f64, 3) + (2.0 * s * s) * k + b * (k @ k)
