"""Normal equations of the fit: smoothness, weight, anchors, lengths and samples.

Row 3 i + k of the band, with a margin before it, holds the coefficients of coordinate k of node i
with itself and the coordinates before it, from right to left.
"""

from lariat.kernel_cache.language import ti
from lariat.perception.centerline.bandwidth import BANDWIDTH, MARGIN
from lariat.perception.centerline.kernels.types import node


@ti.func
def describe_smoothness(
    anchors: ti.template(), smoothness: ti.template(), curve_weight: ti.f64, change_weight: ti.f64
):
    """Write what couples a node with itself and the three before it, the same for all coordinates.

    These are second and third differences, and the anchors.
    """
    n = anchors.shape[0]
    second = ti.Vector([1.0, -2.0, 1.0, 0.0], dt=ti.f64)
    third = ti.Vector([-1.0, 3.0, -3.0, 1.0], dt=ti.f64)
    for i in range(smoothness.shape[0]):
        for k in range(4):
            smoothness[i, k] = 0.0
    for i in range(n):
        if anchors[i, 3] > 0.0:
            smoothness[i, 0] = 1.0 / (anchors[i, 3] * anchors[i, 3])
    for i in range(n - 2):
        for a in ti.static(range(3)):
            for b in ti.static(range(a + 1)):
                smoothness[i + a, a - b] += curve_weight * second[a] * second[b]
    for i in range(n - 3):
        for a in ti.static(range(4)):
            for b in ti.static(range(a + 1)):
                smoothness[i + a, a - b] += change_weight * third[a] * third[b]


@ti.func
def smoothness_gradient(
    nodes: ti.template(), anchors: ti.template(), smoothness: ti.template(), i: ti.i32
):
    """Half the derivative of smoothness and anchors with respect to a node."""
    last = nodes.shape[0] - 1
    total = smoothness[i, 0] * node(nodes, i)
    for k in ti.static(range(1, 4)):
        # Where there is no such node, the coefficient is zero.
        total += smoothness[i, k] * node(nodes, ti.max(0, i - k))
        total += smoothness[i + k, k] * node(nodes, ti.min(last, i + k))
    if anchors[i, 3] > 0.0:
        total -= node(anchors, i) / (anchors[i, 3] * anchors[i, 3])
    return total


@ti.func
def length_terms(edges: ti.template(), j: ti.i32, edge: ti.f64, length_weight: ti.f64):
    """Direction of an edge, and coefficients of the length and of all directions across it."""
    t = ti.Vector([edges[j][2, 0], edges[j][2, 1], edges[j][2, 2]], dt=ti.f64)
    length = t.dot(ti.Vector([edges[j][1, 0], edges[j][1, 1], edges[j][1, 2]], dt=ti.f64))
    error = length - edge
    # A stretched edge resists rotation; without this term a hanging part converges slowly.
    across = ti.max(0.0, error / length) * length_weight
    return t, error, across


@ti.func
def write_normal_equations(
    nodes: ti.template(),
    anchors: ti.template(),
    smoothness: ti.template(),
    edges: ti.template(),
    sums: ti.template(),
    band: ti.template(),
    rhs: ti.template(),
    edge: ti.f64,
    length_weight: ti.f64,
    weight_down: ti.f64,
):
    """Write the band and the right-hand side, one node after the other."""
    n = nodes.shape[0]
    # What the edge before a node adds to its diagonal block, to the one beside it and to the rhs.
    before = ti.Vector([0.0] * 6, dt=ti.f64)
    beside = ti.Vector([0.0] * 6, dt=ti.f64)
    pulled = ti.Vector([0.0] * 3, dt=ti.f64)
    for i in range(n):
        own = smoothness[i, 0]
        # Keeps the system regular where nothing else constrains a node.
        diagonal = before + (own + 1.0) * ti.Vector([1.0, 0.0, 1.0, 0.0, 0.0, 1.0], dt=ti.f64)
        left = beside + smoothness[i, 1] * ti.Vector([1.0, 0.0, 1.0, 0.0, 0.0, 1.0], dt=ti.f64)
        side = -pulled - smoothness_gradient(nodes, anchors, smoothness, i)
        side[2] -= weight_down
        if i + 1 < n:
            t, error, across = length_terms(edges, i, edge, length_weight)
            total = sums[i]
            for k in ti.static(range(3)):
                force = length_weight * error * t[k]
                side[k] += force - total[3, k]
                pulled[k] = force + total[3, 3 + k]
                for m in ti.static(range(k + 1)):
                    c = ti.static(k * (k + 1) // 2 + m)
                    stiffness = (length_weight - across) * t[k] * t[m]
                    if ti.static(k == m):
                        stiffness += across
                    diagonal[c] += total[0, c] + stiffness
                    before[c] = total[2, c] + stiffness
                    beside[c] = total[1, c] - stiffness
        far, farther = smoothness[i, 2], smoothness[i, 3]
        row = MARGIN + 3 * i
        for k in ti.static(range(3)):
            rhs[row + k] = side[k]
            band[row + k] = ti.Matrix([[0.0] * BANDWIDTH], dt=ti.f64)
            for m in ti.static(range(3)):
                c = ti.static(max(k, m) * (max(k, m) + 1) // 2 + min(k, m))
                if ti.static(m <= k):
                    band[row + k][0, k - m] = diagonal[c]
                band[row + k][0, 3 + k - m] = left[c]
            band[row + k][0, 6] = far
            band[row + k][0, 9] = farther
