"""Compiled Gauss-Newton fit of an inextensible chain to rays and ranges.

The unknowns are the positions of n nodes. Every sample is a ray, with or without a measured range
to the rope's surface. It constrains the axis in two directions perpendicular to the rope: the
lateral one, perpendicular to the ray as well, and the depth direction in the plane of ray and rope.
Neither constrains the position along the rope. The normal equations are banded: third differences
couple four neighbouring nodes.
"""

import taichi as ti

from services.perception.centerline.bandwidth import BANDWIDTH, SUM_COLUMNS

EASED_ITERATIONS = 6.0
"""Number of iterations at the start in which lengths and outliers have less influence."""
EASED_SAMPLES, MAX_STRIDE = 8, 8
"""Number of samples for each node that are used in each of them, and number of samples of which at
least one is used."""
EASED_EDGE_SIGMA = 1e-3
"""Standard deviation that is added to the edges' lengths in the first iteration [m]."""
EASED_OUTLIER_FACTOR = 6.0
"""Amount that is added to the outlier scale of one in the first iteration."""
OUTLIER_SIGMAS = 3.0
"""Scale of the robust weight (1 + (r / s)^2)^-2 [standard deviations]."""
OUTLIER_WEIGHT = 0.3
"""Robust weight below which a range counts as an outlier."""
SEARCH_REACH = 3
"""Number of segments on both sides of a sample's first one among which the nearest is searched; of
its last one, the neighbours are."""
RANGE_DISCOUNT = 0.96
"""Share of the squared distance along the ray that this search ignores: ranges are noisier."""
TIE = 1e-9
"""Relative difference of squared distances up to which two segments are equally near [-]."""
MAX_OVERSHOOT = 0.3
"""Overshoot beyond the chain's ends from which a sample is ignored [segments]."""
MAX_SECANT = 2.0
"""Length of an extrapolation, relative to the last move, up to which it is trusted [-]."""
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
def describe_edges(nodes: ti.template(), edges: ti.template()):
    """Write begin, direction, 1 / squared length and 1 / length of every edge."""
    for j in range(edges.shape[0]):
        a = node(nodes, j)
        e = node(nodes, j + 1) - a
        square = e.dot(e)
        for k in ti.static(range(3)):
            edges[j, k] = a[k]
            edges[j, 3 + k] = e[k]
        edges[j, 6] = 1.0 / square
        edges[j, 7] = 1.0 / ti.sqrt(square)


@ti.func
def add_residual(sums: ti.template(), j: ti.i32, s: ti.f64, n, value: ti.f64, weight: ti.f64):
    """Add weight (value + n.((1 - s) dx_j + s dx_(j + 1)))^2 to the sums of an edge."""
    ca, cb = 1.0 - s, s
    aa, ab, bb = weight * ca * ca, weight * ca * cb, weight * cb * cb
    pa, pb = weight * ca * value, weight * cb * value
    for k in ti.static(range(3)):
        for m in ti.static(range(k + 1)):
            product = n[k] * n[m]
            place = ti.static(k * (k + 1) // 2 + m)
            sums[j, place] += aa * product
            sums[j, 6 + place] += ab * product
            sums[j, 12 + place] += bb * product
        sums[j, 18 + k] += pa * n[k]
        sums[j, 21 + k] += pb * n[k]


@ti.func
def add_samples(
    edges: ti.template(),
    samples: ti.template(),
    segments: ti.template(),
    center,
    sums: ti.template(),
    support: ti.template(),
    statistics: ti.template(),
    first: ti.i32,
    stride: ti.i32,
    search: ti.i32,
    scale: ti.f64,
):
    """Assign samples to their nearest edges and add their lateral and range residuals.

    Of `stride` samples, one counts for all.
    """
    last = edges.shape[0] - 1
    cost, count, outliers = 0.0, 0.0, 0.0
    outlier_scale = 1.0 / (OUTLIER_SIGMAS * scale)
    for k in range((samples.shape[0] - first + stride - 1) // stride):
        m = first + k * stride
        ray = ti.Vector([samples[m, 0], samples[m, 1], samples[m, 2]], dt=ti.f64)
        surface_range, axis_depth = samples[m, 3], samples[m, 4]
        guess = segments[m]
        best = 1e30
        chosen = guess
        chosen_s = 0.0
        for j in range(ti.max(0, guess - search), ti.min(last, guess + search) + 1):
            a = ti.Vector([edges[j, 0], edges[j, 1], edges[j, 2]], dt=ti.f64)
            e = ti.Vector([edges[j, 3], edges[j, 4], edges[j, 5]], dt=ti.f64)
            begin = a - center
            reach = surface_range + axis_depth
            if surface_range <= 0.0:
                reach = (begin + 0.5 * e).dot(ray)
            p = reach * ray - begin
            s = p.dot(e) * edges[j, 6]
            gap = p - ti.min(1.0, ti.max(0.0, s)) * e
            along = gap.dot(ray)
            distance = gap.dot(gap) - RANGE_DISCOUNT * along * along
            # Outside of a bend, both edges are as near: the first counts, whatever the last bits.
            if distance < (1.0 - TIE) * best:
                best = distance
                chosen = j
                chosen_s = s
        segments[m] = chosen
        beyond = (chosen == 0 and chosen_s < -MAX_OVERSHOOT) or (
            chosen == last and chosen_s > 1.0 + MAX_OVERSHOOT
        )
        s = ti.min(1.0, ti.max(0.0, chosen_s))
        a = ti.Vector([edges[chosen, 0], edges[chosen, 1], edges[chosen, 2]], dt=ti.f64)
        e = ti.Vector([edges[chosen, 3], edges[chosen, 4], edges[chosen, 5]], dt=ti.f64)
        t = e * edges[chosen, 7]
        across = t.cross(ray)
        sine = across.norm()
        if not beyond and sine > MIN_SINE:
            lateral = across / sine
            foot = a + s * e - center
            if samples[m, 6] > 0.0:
                reach = foot.dot(ray)
                precision = 1.0 / (samples[m, 6] * reach)
                value = lateral.dot(foot - reach * ray)
                ratio = value * precision
                spread = 1.0 + ratio * ratio * outlier_scale * outlier_scale
                robust = 1.0 / (spread * spread)
                add_residual(sums, chosen, s, lateral, value, stride * robust * precision**2)
                cost += robust * ratio * ratio
                count += robust
            if surface_range > 0.0:
                # Perpendicular to the rope, away from the eye.
                depth = lateral.cross(t)
                if depth.dot(ray) < 0.0:
                    depth = -depth
                # The error of the perpendicular distance is that of the range, projected on it.
                precision = 1.0 / (samples[m, 5] * sine)
                value = depth.dot(foot - surface_range * ray) - axis_depth
                ratio = value * precision
                spread = 1.0 + ratio * ratio * outlier_scale * outlier_scale
                robust = 1.0 / (spread * spread)
                add_residual(sums, chosen, s, depth, value, stride * robust * precision**2)
                cost += robust * ratio * ratio
                count += robust
                if robust < OUTLIER_WEIGHT:
                    outliers += 1.0
                support[chosen] += robust * (1.0 - s)
                support[chosen + 1] += robust * s
    statistics[0] = cost
    statistics[1] = count
    statistics[2] = outliers


@ti.func
def add_sums(sums: ti.template(), matrix: ti.template(), rhs: ti.template()):
    """Add the sums of all edges to the normal equations."""
    for j in range(sums.shape[0]):
        for k in ti.static(range(3)):
            rhs[3 * j + k] -= sums[j, 18 + k]
            rhs[3 * j + 3 + k] -= sums[j, 21 + k]
            for m in ti.static(range(3)):
                place = ti.static(max(k, m) * (max(k, m) + 1) // 2 + min(k, m))
                if ti.static(m <= k):
                    matrix[3 * j + k, k - m] += sums[j, place]
                    matrix[3 * j + 3 + k, k - m] += sums[j, 12 + place]
                matrix[3 * j + 3 + k, 3 + k - m] += sums[j, 6 + place]


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
    """Banded Cholesky factorisation in place.

    Row i keeps L[i, i - k] in column k, and 1 / L[i, i] in column 0.
    """
    for i in range(matrix.shape[0]):
        for k in ti.static(range(BANDWIDTH)):
            column = ti.static(BANDWIDTH - 1 - k)
            j = i - column
            if j >= 0:
                total = matrix[i, column]
                # Columns left of the matrix hold zeros.
                for q in ti.static(range(column + 1, BANDWIDTH)):
                    total -= matrix[i, q] * matrix[j, q - column]
                if ti.static(column == 0):
                    matrix[i, 0] = 1.0 / ti.sqrt(ti.max(total, 1e-12))
                else:
                    matrix[i, column] = total * matrix[j, 0]


@ti.func
def solve_factorized(matrix: ti.template(), rhs: ti.template()):
    """Overwrite the right-hand side with the solution of L L^T x = rhs."""
    size = matrix.shape[0]
    for i in range(size):
        total = rhs[i]
        for k in range(1, ti.min(BANDWIDTH, i + 1)):
            total -= matrix[i, k] * rhs[i - k]
        rhs[i] = total * matrix[i, 0]
    for r in range(size):
        i = size - 1 - r
        total = rhs[i]
        for k in range(1, ti.min(BANDWIDTH, size - i)):
            total -= matrix[i + k, k] * rhs[i + k]
        rhs[i] = total * matrix[i, 0]


@ti.func
def position_variances(matrix: ti.template(), columns: ti.template(), variance: ti.template()):
    """Write the trace of every node's covariance: one solve for each coordinate.

    BANDWIDTH of them are solved at once, each in one column of `columns`.
    """
    size = matrix.shape[0]
    for i in range(variance.shape[0]):
        variance[i] = 0.0
    for block in range((size + BANDWIDTH - 1) // BANDWIDTH):
        start = block * BANDWIDTH
        squares = ti.Vector([0.0] * BANDWIDTH, dt=ti.f64)
        for i in range(start, size):
            total = ti.Vector([0.0] * BANDWIDTH, dt=ti.f64)
            for r in ti.static(range(BANDWIDTH)):
                if i == start + r:
                    total[r] = 1.0
            for k in range(1, ti.min(BANDWIDTH, i - start + 1)):
                factor = matrix[i, k]
                for r in ti.static(range(BANDWIDTH)):
                    total[r] -= factor * columns[i - k, r]
            factor = matrix[i, 0]
            for r in ti.static(range(BANDWIDTH)):
                columns[i, r] = factor * total[r]
                squares[r] += columns[i, r] ** 2
        for r in ti.static(range(BANDWIDTH)):
            if start + r < size:
                variance[(start + r) // 3] += squares[r]


@ti.func
def limit_steps(steps: ti.template(), longest: ti.f64):
    """Shorten the steps of nodes that are too long, and return the longest of all [m].

    Far from the solution the linearised lengths mislead.
    """
    largest = 0.0
    for i in range(steps.shape[0] // 3):
        step = ti.Vector([steps[3 * i], steps[3 * i + 1], steps[3 * i + 2]], dt=ti.f64)
        step *= ti.min(1.0, longest / ti.max(step.norm(), 1e-12))
        largest = ti.max(largest, step.norm())
        for k in ti.static(range(3)):
            steps[3 * i + k] = step[k]
    return largest


@ti.func
def move_nodes(nodes: ti.template(), steps: ti.template(), moves: ti.template(), settled: ti.i32):
    """Move the nodes by the steps; once the problem is settled, by a secant through the last ones.

    Robust weights make the steps fall by a constant factor, which the secant (Anderson 1965, of
    one step) extrapolates. Column 0 of `moves` keeps the last step, column 1 the last move.
    """
    product, square = 0.0, 0.0
    for c in range(steps.shape[0]):
        change = steps[c] - moves[c, 0]
        product += steps[c] * change
        square += change * change
    share = 0.0
    if settled and square > 0.0:
        share = ti.min(0.0, ti.max(-MAX_SECANT, product / square))
    for c in range(steps.shape[0]):
        move = steps[c] - share * (moves[c, 1] + steps[c] - moves[c, 0])
        moves[c, 0] = steps[c]
        moves[c, 1] = move
        nodes[c // 3, c % 3] += move


@ti.kernel
def fit(
    nodes: matrix_f64,
    samples: matrix_f64,
    segments: vector_i32,
    eye: vector_f64,
    anchors: matrix_f64,
    matrix: matrix_f64,
    columns: matrix_f64,
    edges: matrix_f64,
    sums: matrix_f64,
    moves: matrix_f64,
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
        columns: Scratch (3n, BANDWIDTH).
        edges: Scratch (n - 1, EDGE_COLUMNS).
        sums: Scratch (n - 1, SUM_COLUMNS).
        moves: Scratch (3n, 2).
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
            for j in range(n - 1):
                for k in range(SUM_COLUMNS):
                    sums[j, k] = 0.0
            describe_edges(nodes, edges)
            # While lengths and outliers are eased, a part of the samples leads far enough.
            stride, first, search = 1, 0, 1
            if iteration <= EASED_ITERATIONS:
                search = SEARCH_REACH
            if iteration < EASED_ITERATIONS:
                stride = ti.max(1, ti.min(MAX_STRIDE, samples.shape[0] // (EASED_SAMPLES * n)))
                first = iteration % stride
            add_samples(
                edges,
                samples,
                segments,
                center,
                sums,
                support,
                statistics,
                first,
                stride,
                search,
                scale,
            )
            add_sums(sums, matrix, rhs)
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
            largest = limit_steps(rhs, edge)
            move_nodes(nodes, rhs, moves, iteration > EASED_ITERATIONS)
            iteration += 1
            done = iteration == iterations or (iteration > 7 and largest < tolerance)
            if done:
                statistics[3] = iteration
                position_variances(matrix, columns, variance)
