"""Vectors and matrices in the array of doubles.

To Taichi, offsets are 32-bit sums that might wrap around. A mask shows the compiler that they do
not: it finds neighbours in memory, and packs them into lanes.

Sums are written `w[i] = w[i] + v`: Taichi turns `w[i] += v` into an atomic addition, with a lock
for each number.
"""

from lariat.kernel_cache.language import ti
from lariat.rod.launch.layout import GROUP_COLUMNS, LANE_COUNT, LANE_STRIDE

MAX_OFFSET, MAX_INDEX = 2**27 - 1, 2**23 - 1
"""Largest offset in the array of doubles, and largest place of a matrix in it."""


@ti.func
def bounded(offset):
    """Offset, of which the compiler knows that small sums with it do not wrap around."""
    return offset & MAX_OFFSET


@ti.func
def bounded_index(index):
    """Place of a matrix, of which the compiler knows that offsets inside do not wrap around."""
    return index & MAX_INDEX


@ti.func
def load3(w: ti.template(), at):
    """Vector of three numbers from `w[at]` on."""
    first = bounded(at)
    return ti.Vector([w[first], w[first + 1], w[first + 2]])


@ti.func
def load4(w: ti.template(), at):
    """Quaternion from `w[at]` on."""
    first = bounded(at)
    return ti.Vector([w[first], w[first + 1], w[first + 2], w[first + 3]])


@ti.func
def load33(w: ti.template(), at):
    """3x3 matrix from `w[at]` on, row by row."""
    first = bounded(at)
    return ti.Matrix(
        [
            [w[first], w[first + 1], w[first + 2]],
            [w[first + 3], w[first + 4], w[first + 5]],
            [w[first + 6], w[first + 7], w[first + 8]],
        ]
    )


@ti.func
def store(w: ti.template(), at, v):
    """Write a vector to `w[at]` and after."""
    first = bounded(at)
    for a in ti.static(range(v.n)):
        w[first + a] = v[a]


@ti.func
def store33(w: ti.template(), at, m):
    """Write a 3x3 matrix to `w[at]` and after, row by row."""
    first = bounded(at)
    for a in ti.static(range(3)):
        for b in ti.static(range(3)):
            w[first + 3 * a + b] = m[a, b]


@ti.func
def add(w: ti.template(), at, v):
    """Add a vector to the numbers from `w[at]` on."""
    first = bounded(at)
    for a in ti.static(range(v.n)):
        w[first + a] = w[first + a] + v[a]


@ti.func
def add33(w: ti.template(), at, m):
    """Add a 3x3 matrix to the numbers from `w[at]` on."""
    first = bounded(at)
    for a in ti.static(range(3)):
        for b in ti.static(range(3)):
            w[first + 3 * a + b] = w[first + 3 * a + b] + m[a, b]


@ti.func
def load_column(w: ti.template(), at):
    """Three rows of a column of a group."""
    return ti.Vector([w[at + GROUP_COLUMNS * a] for a in range(3)])


@ti.func
def store_column(w: ti.template(), at, v):
    """Write three rows of a column of a group."""
    for a in ti.static(range(3)):
        w[at + GROUP_COLUMNS * a] = v[a]


@ti.func
def lane_count(count):
    """Number of lanes to evaluate for `count` neighbours: at most LANE_COUNT, a multiple of 4."""
    return (ti.min(count, LANE_COUNT) + 3) & (2 * LANE_COUNT - 4)


@ti.func
def load_lane3(w: ti.template(), at, term: ti.template()):
    """Vector of three terms of a lane."""
    return ti.Vector([w[at + LANE_STRIDE * (term + a)] for a in range(3)])


@ti.func
def load_lane4(w: ti.template(), at, term: ti.template()):
    """Quaternion of four terms of a lane."""
    return ti.Vector([w[at + LANE_STRIDE * (term + a)] for a in range(4)])


@ti.func
def load_lane33(w: ti.template(), at, term: ti.template()):
    """3x3 matrix of nine terms of a lane, row by row."""
    return ti.Matrix(
        [[w[at + LANE_STRIDE * (term + 3 * a + b)] for b in range(3)] for a in range(3)]
    )


@ti.func
def load_lane_symmetric(w: ti.template(), at, term: ti.template()):
    """Symmetric 3x3 matrix of six terms of a lane: xx, xy, yy, xz, yz, zz."""
    m = ti.Matrix.zero(ti.f64, 3, 3)
    for a in ti.static(range(3)):
        for b in ti.static(range(a + 1)):
            m[a, b] = w[at + LANE_STRIDE * (term + a * (a + 1) // 2 + b)]
            m[b, a] = m[a, b]
    return m


@ti.func
def store_lane(w: ti.template(), at, term: ti.template(), v):
    """Write a vector to the terms of a lane from `term` on."""
    for a in ti.static(range(v.n)):
        w[at + LANE_STRIDE * (term + a)] = v[a]


@ti.func
def store_lane33(w: ti.template(), at, term: ti.template(), m):
    """Write a 3x3 matrix to nine terms of a lane, row by row."""
    for a in ti.static(range(3)):
        for b in ti.static(range(3)):
            w[at + LANE_STRIDE * (term + 3 * a + b)] = m[a, b]


@ti.func
def store_lane_symmetric(w: ti.template(), at, term: ti.template(), m):
    """Write the symmetric part of a 3x3 matrix to six terms of a lane."""
    for a in ti.static(range(3)):
        for b in ti.static(range(a + 1)):
            w[at + LANE_STRIDE * (term + a * (a + 1) // 2 + b)] = 0.5 * (m[a, b] + m[b, a])
