"""Sums over the samples of every edge."""

from lariat.kernel_cache.language import ti
from lariat.perception.centerline.kernels.types import node

OUTLIER_SIGMAS = 3.0
"""Scale of the robust weight (1 + (r / s)^2)^-2 [standard deviations]."""
OUTLIER_WEIGHT = 0.3
"""Robust weight below which a range counts as an outlier."""
RANGE_DISCOUNT = 0.96
"""Share of the squared distance along the ray that the search of the nearest edge ignores: ranges
are noisier."""
TIE = 1e-9
"""Relative difference of squared distances up to which two edges are equally near [-]."""
MAX_OVERSHOOT = 0.3
"""Overshoot beyond the chain's ends from which a sample is ignored [edges]."""
MIN_SINE = 0.05
"""Sine between ray and rope below which a sample is ignored."""


@ti.func
def describe_edges(nodes: ti.template(), center, edges: ti.template()):
    """Write begin from the centre of projection, extent, direction, 1 / squared length of edges."""
    for j in range(edges.shape[0]):
        a = node(nodes, j)
        e = node(nodes, j + 1) - a
        square = e.dot(e)
        t = e / ti.sqrt(square)
        a -= center
        edges[j] = ti.Matrix(
            [
                [a[0], a[1], a[2]],
                [e[0], e[1], e[2]],
                [t[0], t[1], t[2]],
                [1.0 / square, 0.0, 0.0],
            ],
            dt=ti.f64,
        )


@ti.func
def place_on_edge(edges: ti.template(), j: ti.i32, ray, reach: ti.f64):
    """Place of a sample along an edge [edges], its squared distance, and the side to go on.

    Without a range, a `reach` of 0, the sample is as far away as the middle of the edge.
    """
    a = ti.Vector([edges[j][0, 0], edges[j][0, 1], edges[j][0, 2]], dt=ti.f64)
    e = ti.Vector([edges[j][1, 0], edges[j][1, 1], edges[j][1, 2]], dt=ti.f64)
    depth, slope = reach, e.dot(ray)
    if reach <= 0.0:
        depth = a.dot(ray) + 0.5 * slope
    p = depth * ray - a
    product, along = p.dot(e), p.dot(ray)
    place = product * edges[j][3, 0]
    s = ti.min(1.0, ti.max(0.0, place))
    gap = p - s * e
    off = along - s * slope
    # Where along the edge the distance would be the least.
    twice = 2.0 * (product - RANGE_DISCOUNT * along * slope)
    side = ti.select(twice < e.dot(e) - RANGE_DISCOUNT * slope * slope, -1, 1)
    return place, gap.dot(gap) - RANGE_DISCOUNT * off * off, side


@ti.func
def nearest_edge(edges: ti.template(), guess: ti.i32, ray, reach: ti.f64, steps: ti.i32):
    """Edge next to a sample, and the sample's place along it [edges].

    From the guess on, neighbours are tried while they are nearer.
    """
    last = edges.shape[0] - 1
    chosen = guess
    place, distance, side = place_on_edge(edges, chosen, ray, reach)
    for _ in range(steps):
        beside = ti.min(last, ti.max(0, chosen + side))
        other_place, other, onward = place_on_edge(edges, beside, ray, reach)
        # Outside of a bend, both edges are as near: the first counts, whatever the last bits.
        favour = ti.select(side > 0, 1.0 - TIE, 1.0 / (1.0 - TIE))
        if beside == chosen or other >= favour * distance or onward != side:
            if other < favour * distance:
                chosen, place = beside, other_place
            break
        chosen, place, distance = beside, other_place, other
    return chosen, place


@ti.func
def add_samples(
    edges: ti.template(),
    samples: ti.template(),
    segments: ti.template(),
    sums: ti.template(),
    support: ti.template(),
    statistics: ti.template(),
    first: ti.i32,
    stride: ti.i32,
    search: ti.i32,
    scale: ti.f64,
):
    """Assign samples to their nearest edges and add their residuals to the sums of these.

    Of `stride` samples, one counts for all. The sums of an edge are those of weight n n^T, as the
    lower triangles of its three blocks of the normal equations, and of weight n r, for both nodes.
    """
    last = edges.shape[0] - 1
    cost, count, outliers = 0.0, 0.0, 0.0
    tail = 1.0 / (OUTLIER_SIGMAS * OUTLIER_SIGMAS * scale * scale)
    for k in range((samples.shape[0] - first + stride - 1) // stride):
        m = first + k * stride
        ray = ti.Vector([samples[m, 0], samples[m, 1], samples[m, 2]], dt=ti.f64)
        surface, axis_depth, sigma = samples[m, 3], samples[m, 4], samples[m, 5]
        reach = surface + axis_depth
        j, place = nearest_edge(edges, segments[m], ray, reach, search)
        segments[m] = j
        beyond = (j == 0 and place < -MAX_OVERSHOOT) or (j == last and place > 1.0 + MAX_OVERSHOOT)
        s = ti.min(1.0, ti.max(0.0, place))
        foot = ti.Vector([edges[j][0, 0], edges[j][0, 1], edges[j][0, 2]], dt=ti.f64)
        foot += s * ti.Vector([edges[j][1, 0], edges[j][1, 1], edges[j][1, 2]], dt=ti.f64)
        t = ti.Vector([edges[j][2, 0], edges[j][2, 1], edges[j][2, 2]], dt=ti.f64)
        across = t.cross(ray)
        square = across.dot(across)
        if not beyond and square > MIN_SINE * MIN_SINE:
            # Lengths of n and of the residual are those of their multiples by the sine.
            sine = ti.sqrt(square)
            n = across
            value = across.dot(foot)
            precision = 1.0 / (sigma * foot.dot(ray) * sine)
            if surface > 0.0:
                # Perpendicular to the rope, away from the eye. The error of the perpendicular
                # distance is that of the range, projected on it.
                n = ray - t.dot(ray) * t
                value = n.dot(foot) - surface * square - axis_depth * sine
                precision = 1.0 / (sigma * square)
            ratio = value * precision
            ratio *= ratio
            spread = 1.0 / (1.0 + ratio * tail)
            robust = spread * spread
            weight = stride * robust * precision * precision
            cost += robust * ratio
            count += robust
            if surface > 0.0:
                if robust < OUTLIER_WEIGHT:
                    outliers += 1.0
                support[j] += robust * (1.0 - s)
                support[j + 1] += robust * s
            products = ti.Vector(
                [n[0] * n[0], n[1] * n[0], n[1] * n[1], n[2] * n[0], n[2] * n[1], n[2] * n[2]],
                dt=ti.f64,
            )
            near, far = weight * (1.0 - s), weight * s
            both, pull, push = near * s, near * value, far * value
            near *= 1.0 - s
            far *= s
            total = sums[j]
            for c in ti.static(range(6)):
                total[0, c] += near * products[c]
                total[1, c] += both * products[c]
                total[2, c] += far * products[c]
            for c in ti.static(range(3)):
                total[3, c] += pull * n[c]
                total[3, 3 + c] += push * n[c]
            sums[j] = total
    statistics[0] = cost
    statistics[1] = count
    statistics[2] = outliers
