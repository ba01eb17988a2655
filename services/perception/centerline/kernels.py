"""Compiled Gauss-Newton fit of an inextensible chain to rays and ranges.

The unknowns are the positions of n nodes. Every sample is a ray, with or without a measured range
to the rope's surface. It constrains the axis in two directions perpendicular to the rope: the
lateral one, perpendicular to the ray as well, and the depth direction in the plane of ray and rope.
Neither constrains the position along the rope. The normal equations are banded: third differences
couple four neighbouring nodes.
"""

import taichi as ti

from services.perception.centerline.bandwidth import BANDWIDTH

EASED_ITERATIONS = 6.0
"""Number of iterations at the start in which lengths and outliers have less influence."""
EASED_EDGE_SIGMA = 1e-3
"""Standard deviation that is added to the edges' lengths in the first iteration [m]."""
EASED_OUTLIER_FACTOR = 6.0
"""Amount that is added to the outlier scale of one in the first iteration."""
OUTLIER_SIGMAS = 3.0
"""Scale of the robust weight (1 + (r / s)^2)^-2 [standard deviations]."""
OUTLIER_WEIGHT = 0.3
"""Robust weight below which a range counts as an outlier."""
SEARCH_REACH = 3
"""Number of segments on both sides of a sample's last one among which the nearest is searched."""
RANGE_DISCOUNT = 0.96
"""Share of the squared distance along the ray that this search ignores: ranges are noisier."""
MAX_OVERSHOOT = 0.3
"""Overshoot beyond the chain's ends from which a sample is ignored [segments]."""
MIN_SINE = 0.05
"""Sine between ray and rope below which a sample is ignored."""

matrix_f64 = ti.types.ndarray(dtype=ti.f64, ndim=2)
vector_f64 = ti.types.ndarray(dtype=ti.f64, ndim=1)
vector_i32 = ti.types.ndarray(dtype=ti.i32, ndim=1)


@ti.func
def node(nodes: ti.template(), i: ti.i32):
    return ti.Vector([nodes[i, 0], nodes[i, 1], nodes[i, 2]], dt=ti.f64)


@ti.func
def add_difference(
    matrix: ti.template(), rhs: ti.template(), first: ti.i32, order: ti.i32, residual, weight
):
    """Add weight |residual + sum_k c_k dx_(first + k)|^2 of a finite difference of some order."""
    c = ti.Vector([1.0, -2.0, 1.0, 0.0], dt=ti.f64)
    if order == 3:
        c = ti.Vector([-1.0, 3.0, -3.0, 1.0], dt=ti.f64)
    elif order == 0:
        c = ti.Vector([1.0, 0.0, 0.0, 0.0], dt=ti.f64)
    for a in range(order + 1):
        for b in range(a + 1):
            for k in ti.static(range(3)):
                matrix[3 * (first + a) + k, 3 * (a - b)] += weight * c[a] * c[b]
        for k in ti.static(range(3)):
            rhs[3 * (first + a) + k] -= weight * c[a] * residual[k]


@ti.func
def add_direction(
    matrix: ti.template(), rhs: ti.template(), i: ti.i32, ca: ti.f64, cb: ti.f64, n, value, weight
):
    """Add weight (value + n.(ca dx_i + cb dx_(i + 1)))^2."""
    for k in ti.static(range(3)):
        rhs[3 * i + k] -= weight * ca * n[k] * value
        rhs[3 * i + 3 + k] -= weight * cb * n[k] * value
        for m in ti.static(range(3)):
            if ti.static(m <= k):
                matrix[3 * i + k, k - m] += weight * ca * ca * n[k] * n[m]
                matrix[3 * i + 3 + k, k - m] += weight * cb * cb * n[k] * n[m]
            matrix[3 * i + 3 + k, 3 + k - m] += weight * ca * cb * n[k] * n[m]


@ti.func
def add_sample(
    nodes: ti.template(),
    samples: ti.template(),
    segments: ti.template(),
    center,
    matrix: ti.template(),
    rhs: ti.template(),
    support: ti.template(),
    statistics: ti.template(),
    m: ti.i32,
    scale: ti.f64,
):
    """Assign sample m to its nearest segment and add its lateral and range residuals."""
    n = nodes.shape[0]
    ray = ti.Vector([samples[m, 0], samples[m, 1], samples[m, 2]], dt=ti.f64)
    surface_range, axis_depth = samples[m, 3], samples[m, 4]
    guess = segments[m]
    best = 1e30
    chosen = guess
    chosen_s = 0.0
    for j in range(ti.max(0, guess - SEARCH_REACH), ti.min(n - 1, guess + SEARCH_REACH + 1)):
        a = node(nodes, j)
        e = node(nodes, j + 1) - a
        reach = surface_range + axis_depth
        if surface_range <= 0.0:
            reach = (a + 0.5 * e - center).dot(ray)
        p = center + reach * ray
        s = (p - a).dot(e) / e.dot(e)
        clamped = ti.min(1.0, ti.max(0.0, s))
        gap = p - a - clamped * e
        along = gap.dot(ray)
        distance = gap.dot(gap) - RANGE_DISCOUNT * along * along
        if distance < best:
            best = distance
            chosen = j
            chosen_s = s
    segments[m] = chosen
    beyond = (chosen == 0 and chosen_s < -MAX_OVERSHOOT) or (
        chosen == n - 2 and chosen_s > 1.0 + MAX_OVERSHOOT
    )
    if not beyond:
        s = ti.min(1.0, ti.max(0.0, chosen_s))
        a = node(nodes, chosen)
        e = node(nodes, chosen + 1) - a
        t = e.normalized()
        across = t.cross(ray)
        sine = across.norm()
        if sine > MIN_SINE:
            lateral = across / sine
            depth = lateral.cross(t)
            if depth.dot(ray) < 0.0:
                depth = -depth
            foot = a + s * e
            reach = (foot - center).dot(ray)
            if samples[m, 6] > 0.0:
                sigma = samples[m, 6] * reach
                value = lateral.dot(foot - center - reach * ray)
                ratio = value / (OUTLIER_SIGMAS * scale * sigma)
                robust = 1.0 / ((1.0 + ratio * ratio) * (1.0 + ratio * ratio))
                weight = robust / (sigma * sigma)
                add_direction(matrix, rhs, chosen, 1.0 - s, s, lateral, value, weight)
                statistics[0] += robust * value * value / (sigma * sigma)
                statistics[1] += robust
            if surface_range > 0.0:
                # The error of the perpendicular distance is that of the range, projected on it.
                sigma = samples[m, 5] * sine
                value = depth.dot(foot - center - surface_range * ray) - axis_depth
                ratio = value / (OUTLIER_SIGMAS * scale * sigma)
                robust = 1.0 / ((1.0 + ratio * ratio) * (1.0 + ratio * ratio))
                weight = robust / (sigma * sigma)
                add_direction(matrix, rhs, chosen, 1.0 - s, s, depth, value, weight)
                statistics[0] += robust * value * value / (sigma * sigma)
                statistics[1] += robust
                if robust < OUTLIER_WEIGHT:
                    statistics[2] += 1.0
                support[chosen] += robust * (1.0 - s)
                support[chosen + 1] += robust * s


@ti.func
def add_priors(
    nodes: ti.template(),
    anchors: ti.template(),
    matrix: ti.template(),
    rhs: ti.template(),
    i: ti.i32,
    edge: ti.f64,
    sigma_edge: ti.f64,
    sigma_curve: ti.f64,
    weight_down: ti.f64,
    sigma_change: ti.f64,
):
    """Add the anchor and weight of node i, and the bending and length terms that begin at it."""
    n = nodes.shape[0]
    if anchors[i, 3] > 0.0:
        gap = node(nodes, i) - node(anchors, i)
        add_difference(matrix, rhs, i, 0, gap, 1.0 / (anchors[i, 3] * anchors[i, 3]))
    rhs[3 * i + 2] -= weight_down
    if i + 2 < n:
        bend = node(nodes, i) - 2.0 * node(nodes, i + 1) + node(nodes, i + 2)
        add_difference(matrix, rhs, i, 2, bend, 1.0 / (sigma_curve * sigma_curve))
    if i + 3 < n:
        change = node(nodes, i + 3) - 3.0 * node(nodes, i + 2)
        change += 3.0 * node(nodes, i + 1) - node(nodes, i)
        add_difference(matrix, rhs, i, 3, change, 1.0 / (sigma_change * sigma_change))
    if i + 1 < n:
        e = node(nodes, i + 1) - node(nodes, i)
        length = e.norm()
        t = e / length
        add_direction(matrix, rhs, i, -1.0, 1.0, t, length - edge, 1.0 / sigma_edge**2)
        # A stretched edge resists rotation; without this term a hanging part converges slowly.
        pull = ti.max(0.0, (length - edge) / (length * sigma_edge**2))
        for k in ti.static(range(3)):
            for m in ti.static(range(3)):
                side = -pull * t[k] * t[m]
                if ti.static(m == k):
                    side += pull
                if ti.static(m <= k):
                    matrix[3 * i + k, k - m] += side
                    matrix[3 * i + 3 + k, k - m] += side
                matrix[3 * i + 3 + k, 3 + k - m] -= side


@ti.func
def factorize(matrix: ti.template()):
    """Banded Cholesky factorisation in place: row i keeps L[i, i - k] in column k."""
    for i in range(matrix.shape[0]):
        for k in range(BANDWIDTH):
            column = BANDWIDTH - 1 - k
            j = i - column
            if j >= 0:
                total = matrix[i, column]
                for q in range(column + 1, BANDWIDTH):
                    other = q - column
                    if i - q >= 0:
                        total -= matrix[i, q] * matrix[j, other]
                if column == 0:
                    matrix[i, 0] = ti.sqrt(ti.max(total, 1e-12))
                else:
                    matrix[i, column] = total / matrix[j, 0]


@ti.func
def solve_factorized(matrix: ti.template(), rhs: ti.template()):
    """Overwrite the right-hand side with the solution of L L^T x = rhs."""
    size = matrix.shape[0]
    for i in range(size):
        total = rhs[i]
        for k in range(1, BANDWIDTH):
            if i - k >= 0:
                total -= matrix[i, k] * rhs[i - k]
        rhs[i] = total / matrix[i, 0]
    for r in range(size):
        i = size - 1 - r
        total = rhs[i]
        for k in range(1, BANDWIDTH):
            if i + k < size:
                total -= matrix[i + k, k] * rhs[i + k]
        rhs[i] = total / matrix[i, 0]


@ti.func
def position_variances(matrix: ti.template(), rhs: ti.template(), variance: ti.template()):
    """Write the trace of every node's covariance: one solve for each coordinate."""
    size = matrix.shape[0]
    for i in range(variance.shape[0]):
        variance[i] = 0.0
    for c in range(size):
        for i in range(c, size):
            total = 1.0 if i == c else 0.0
            for k in range(1, BANDWIDTH):
                if i - k >= c:
                    total -= matrix[i, k] * rhs[i - k]
            rhs[i] = total / matrix[i, 0]
            variance[c // 3] += rhs[i] * rhs[i]


@ti.kernel
def fit(
    nodes: matrix_f64,
    samples: matrix_f64,
    segments: vector_i32,
    eye: vector_f64,
    anchors: matrix_f64,
    matrix: matrix_f64,
    rhs: vector_f64,
    support: vector_f64,
    variance: vector_f64,
    statistics: vector_f64,
    edge: ti.f64,
    sigma_edge: ti.f64,
    sigma_curve: ti.f64,
    weight_down: ti.f64,
    sigma_change: ti.f64,
    tolerance: ti.f64,
    iterations: ti.i32,
):
    """Minimise the residuals of samples, anchors and lengths plus the energy of bending and weight.

    With both energies, an unobserved part hangs as a rope at rest would.

    Args:
        nodes: (n, 3) initial positions, overwritten by the fit [m].
        samples: (m, 7): unit ray, range to the surface [m] (0: none), depth of the axis below the
            surface [m], standard deviation of the range [m], standard deviation of the ray [rad]
            (0: none).
        segments: (m,) index of the segment on which every sample is assumed to lie, updated.
        eye: Centre of projection [m].
        anchors: (n, 4) expected position of each node and its standard deviation [m]; 0: none.
        matrix: Scratch (3n, BANDWIDTH).
        rhs: Scratch (3n,).
        support: (n,) weighted number of ranges around every node, written.
        variance: (n,) trace of every node's covariance [m^2], written.
        statistics: Sum of squared normalised residuals, their count, outliers, iterations; written.
        edge: Length of every edge [m].
        sigma_edge: Standard deviation of the edges' lengths [m].
        sigma_curve: Standard deviation of second differences [m].
        weight_down: Cost of a node's height due to the rope's weight [1/m].
        sigma_change: Standard deviation of third differences [m].
        tolerance: Largest step of a node at which the iteration has converged [m].
        iterations: Largest number of iterations.
    """
    n = nodes.shape[0]
    center = ti.Vector([eye[0], eye[1], eye[2]], dt=ti.f64)
    ti.loop_config(serialize=True)
    for _ in range(1):
        done = False
        iteration = 0
        while not done:
            ease = ti.max(0.0, 1.0 - iteration / EASED_ITERATIONS)
            stiff = sigma_edge + ease * ease * EASED_EDGE_SIGMA
            scale = 1.0 + EASED_OUTLIER_FACTOR * ease
            for i in range(3 * n):
                rhs[i] = 0.0
                for k in range(BANDWIDTH):
                    matrix[i, k] = 0.0
                # Keeps the system regular where nothing else constrains a node.
                matrix[i, 0] = 1.0
            for i in range(n):
                support[i] = 0.0
            statistics[0] = 0.0
            statistics[1] = 0.0
            statistics[2] = 0.0
            for m in range(samples.shape[0]):
                add_sample(
                    nodes, samples, segments, center, matrix, rhs, support, statistics, m, scale
                )
            for i in range(n):
                add_priors(
                    nodes,
                    anchors,
                    matrix,
                    rhs,
                    i,
                    edge,
                    stiff,
                    sigma_curve,
                    weight_down,
                    sigma_change,
                )
            factorize(matrix)
            solve_factorized(matrix, rhs)
            largest = 0.0
            for i in range(n):
                step = ti.Vector([rhs[3 * i], rhs[3 * i + 1], rhs[3 * i + 2]], dt=ti.f64)
                # Far from the solution the linearised lengths mislead.
                step *= ti.min(1.0, edge / ti.max(step.norm(), 1e-12))
                largest = ti.max(largest, step.norm())
                for k in ti.static(range(3)):
                    nodes[i, k] += step[k]

            iteration += 1
            done = iteration == iterations or (iteration > 7 and largest < tolerance)
            if done:
                statistics[3] = iteration
                position_variances(matrix, rhs, variance)
