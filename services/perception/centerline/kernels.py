"""The inextensible fit of a chain to what a camera saw, compiled.

Unknown are the positions of n nodes. Every sample is one ray with a measured range to the rope's
surface; what it says about the axis is split into a lateral part (perpendicular to ray and rope)
and a part in the plane of ray and rope, perpendicular to the rope, so that neither says anything
along the rope. The normal equations are banded: third differences couple four nodes in a row.
"""

import taichi as ti

BAND = 12
"""Stored diagonals of the symmetric matrix, the main one among them: four nodes of three."""

rows_f64 = ti.types.ndarray(dtype=ti.f64, ndim=2)
vector_f64 = ti.types.ndarray(dtype=ti.f64, ndim=1)
vector_i32 = ti.types.ndarray(dtype=ti.i32, ndim=1)


@ti.func
def node(nodes: ti.template(), i: ti.i32):
    return ti.Vector([nodes[i, 0], nodes[i, 1], nodes[i, 2]], dt=ti.f64)


@ti.func
def add_difference(
    matrix: ti.template(), right: ti.template(), first: ti.i32, order: ti.i32, residual, weight
):
    """Adds weight |residual + sum_k c_k dx_(first + k)|^2 of a finite difference of some order."""
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
            right[3 * (first + a) + k] -= weight * c[a] * residual[k]


@ti.func
def add_direction(
    matrix: ti.template(), right: ti.template(), i: ti.i32, ca: ti.f64, cb: ti.f64, n, value, weight
):
    """Adds weight (value + n.(ca dx_i + cb dx_(i + 1)))^2."""
    for k in ti.static(range(3)):
        right[3 * i + k] -= weight * ca * n[k] * value
        right[3 * i + 3 + k] -= weight * cb * n[k] * value
        for m in ti.static(range(3)):
            if ti.static(m <= k):
                matrix[3 * i + k, k - m] += weight * ca * ca * n[k] * n[m]
                matrix[3 * i + 3 + k, k - m] += weight * cb * cb * n[k] * n[m]
            matrix[3 * i + 3 + k, 3 + k - m] += weight * ca * cb * n[k] * n[m]


@ti.kernel
def fit(
    nodes: rows_f64,
    samples: rows_f64,
    segments: vector_i32,
    eye: vector_f64,
    anchors: rows_f64,
    matrix: rows_f64,
    right: vector_f64,
    support: vector_f64,
    variance: vector_f64,
    report: vector_f64,
    edge: ti.f64,
    sigma_edge: ti.f64,
    sigma_curve: ti.f64,
    weight_down: ti.f64,
    sigma_change: ti.f64,
    tolerance: ti.f64,
    iterations: ti.i32,
):
    """Gauss-Newton on data, anchors, length and the energy of bending and weight.

    With both energies a part that nothing is known of hangs as a rope at rest would.

    Args:
        nodes: (n, 3) start, overwritten by the fit [m].
        samples: (m, 7): unit ray, range to the surface [m] (0: none), depth of the axis below the
            surface [m], deviation of the range [m], deviation of the ray [rad] (0: none).
        segments: (m,) segment that every sample is thought to lie on, updated.
        eye: Centre of projection [m].
        anchors: (n, 4) point that a node is pulled to and its deviation [m]; 0: none.
        matrix, right: Scratch (3n, BAND), (3n,).
        support: (n,) samples with a range around every node, written.
        variance: (n,) trace of every node's covariance [m^2], written.
        report: Sum of squared normalised residuals, their count, outliers, iterations; written.
        edge: Length of every edge [m].
        sigma_edge: Deviation of the edges' lengths [m].
        sigma_curve: Deviation of second differences [m].
        weight_down: What the rope's weight adds to the cost per height of a node [1/m].
        sigma_change: Deviation of third differences [m].
        tolerance: Done when no node moves further [m].
        iterations: At most.
    """
    n = nodes.shape[0]
    o = ti.Vector([eye[0], eye[1], eye[2]], dt=ti.f64)
    for _ in range(1):
        done = False
        iteration = 0
        while not done:
            # Lengths and outliers are taken ever more seriously.
            ease = ti.max(0.0, 1.0 - iteration / 6.0)
            stiff = sigma_edge + ease * ease * 1e-3
            scale = 1.0 + 6.0 * ease
            for i in range(3 * n):
                right[i] = 0.0
                for k in range(BAND):
                    matrix[i, k] = 0.0
                # Keeps the system regular where nothing else holds a node.
                matrix[i, 0] = 1.0
            for i in range(n):
                support[i] = 0.0
            report[0] = 0.0
            report[1] = 0.0
            report[2] = 0.0

            for m in range(samples.shape[0]):
                d = ti.Vector([samples[m, 0], samples[m, 1], samples[m, 2]], dt=ti.f64)
                rho, below = samples[m, 3], samples[m, 4]
                guess = segments[m]
                best = 1e30
                chosen = guess
                chosen_s = 0.0
                for j in range(ti.max(0, guess - 3), ti.min(n - 1, guess + 4)):
                    a = node(nodes, j)
                    e = node(nodes, j + 1) - a
                    reach = rho + below
                    if rho <= 0.0:
                        reach = (a + 0.5 * e - o).dot(d)
                    p = o + reach * d
                    s = (p - a).dot(e) / e.dot(e)
                    clamped = ti.min(1.0, ti.max(0.0, s))
                    gap = p - a - clamped * e
                    along = gap.dot(d)
                    # A range is noisier than a ray.
                    distance = gap.dot(gap) - 0.96 * along * along
                    if distance < best:
                        best = distance
                        chosen = j
                        chosen_s = s
                segments[m] = chosen
                beyond = (chosen == 0 and chosen_s < -0.3) or (chosen == n - 2 and chosen_s > 1.3)
                if not beyond:
                    s = ti.min(1.0, ti.max(0.0, chosen_s))
                    a = node(nodes, chosen)
                    e = node(nodes, chosen + 1) - a
                    t = e.normalized()
                    across = t.cross(d)
                    sine = across.norm()
                    if sine > 0.05:
                        lateral = across / sine
                        deep = lateral.cross(t)
                        if deep.dot(d) < 0.0:
                            deep = -deep
                        on = a + s * e
                        reach = (on - o).dot(d)
                        if samples[m, 6] > 0.0:
                            sigma = samples[m, 6] * reach
                            value = lateral.dot(on - o - reach * d)
                            ratio = value / (3.0 * scale * sigma)
                            trust = 1.0 / ((1.0 + ratio * ratio) * (1.0 + ratio * ratio))
                            weight = trust / (sigma * sigma)
                            add_direction(matrix, right, chosen, 1.0 - s, s, lateral, value, weight)
                            report[0] += trust * value * value / (sigma * sigma)
                            report[1] += trust
                        if rho > 0.0:
                            # Slanted, a range says less about the perpendicular distance.
                            sigma = samples[m, 5] * sine
                            value = deep.dot(on - o - rho * d) - below
                            ratio = value / (3.0 * scale * sigma)
                            trust = 1.0 / ((1.0 + ratio * ratio) * (1.0 + ratio * ratio))
                            add_direction(
                                matrix,
                                right,
                                chosen,
                                1.0 - s,
                                s,
                                deep,
                                value,
                                trust / (sigma * sigma),
                            )
                            report[0] += trust * value * value / (sigma * sigma)
                            report[1] += trust
                            if trust < 0.3:
                                report[2] += 1.0
                            support[chosen] += trust * (1.0 - s)
                            support[chosen + 1] += trust * s

            for i in range(n):
                if anchors[i, 3] > 0.0:
                    gap = node(nodes, i) - node(anchors, i)
                    add_difference(matrix, right, i, 0, gap, 1.0 / (anchors[i, 3] * anchors[i, 3]))
                right[3 * i + 2] -= weight_down
                if i + 2 < n:
                    bend = node(nodes, i) - 2.0 * node(nodes, i + 1) + node(nodes, i + 2)
                    add_difference(matrix, right, i, 2, bend, 1.0 / (sigma_curve * sigma_curve))
                if i + 3 < n:
                    change = node(nodes, i + 3) - 3.0 * node(nodes, i + 2)
                    change += 3.0 * node(nodes, i + 1) - node(nodes, i)
                    add_difference(matrix, right, i, 3, change, 1.0 / (sigma_change * sigma_change))
                if i + 1 < n:
                    e = node(nodes, i + 1) - node(nodes, i)
                    length = e.norm()
                    t = e / length
                    add_direction(matrix, right, i, -1.0, 1.0, t, length - edge, 1.0 / stiff**2)
                    # A taut edge resists being turned; without it a hanging part settles slowly.
                    pull = ti.max(0.0, (length - edge) / (length * stiff**2))
                    for k in ti.static(range(3)):
                        for m in ti.static(range(3)):
                            side = -pull * t[k] * t[m]
                            if ti.static(m == k):
                                side += pull
                            if ti.static(m <= k):
                                matrix[3 * i + k, k - m] += side
                                matrix[3 * i + 3 + k, k - m] += side
                            matrix[3 * i + 3 + k, 3 + k - m] -= side

            # Banded Cholesky in place: row i keeps L[i, i - k] in column k.
            for i in range(3 * n):
                for k in range(BAND):
                    column = BAND - 1 - k
                    j = i - column
                    if j >= 0:
                        total = matrix[i, column]
                        for q in range(column + 1, BAND):
                            other = q - column
                            if i - q >= 0:
                                total -= matrix[i, q] * matrix[j, other]
                        if column == 0:
                            matrix[i, 0] = ti.sqrt(ti.max(total, 1e-12))
                        else:
                            matrix[i, column] = total / matrix[j, 0]
            for i in range(3 * n):
                total = right[i]
                for k in range(1, BAND):
                    if i - k >= 0:
                        total -= matrix[i, k] * right[i - k]
                right[i] = total / matrix[i, 0]
            for r in range(3 * n):
                i = 3 * n - 1 - r
                total = right[i]
                for k in range(1, BAND):
                    if i + k < 3 * n:
                        total -= matrix[i + k, k] * right[i + k]
                right[i] = total / matrix[i, 0]
            largest = 0.0
            for i in range(n):
                step = ti.Vector([right[3 * i], right[3 * i + 1], right[3 * i + 2]], dt=ti.f64)
                # Far from the solution the linearised lengths mislead.
                step *= ti.min(1.0, edge / ti.max(step.norm(), 1e-12))
                largest = ti.max(largest, step.norm())
                for k in ti.static(range(3)):
                    nodes[i, k] += step[k]

            iteration += 1
            done = iteration == iterations or (iteration > 7 and largest < tolerance)
            if done:
                report[3] = iteration
                # Diagonal of the inverse: one solve a coordinate.
                for i in range(n):
                    variance[i] = 0.0
                for c in range(3 * n):
                    for i in range(c, 3 * n):
                        total = 1.0 if i == c else 0.0
                        for k in range(1, BAND):
                            if i - k >= c:
                                total -= matrix[i, k] * right[i - k]
                        right[i] = total / matrix[i, 0]
                        variance[c // 3] += right[i] * right[i]
