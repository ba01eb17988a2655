"""Newton update: store an iterate, and move it along the step.

    x <- x + share s,  q <- q exp(share phi),  tension <- K ((e + share ds) / l - d3 - share dd3)

The tension is linear in the step: it is the force that the linear solve predicted (mixed Newton).
"""

from lariat.kernel_cache.language import ti
from lariat.rod.kernels.addressing import orientation_at, position_at, scalar
from lariat.rod.kernels.energy import edge_energy
from lariat.rod.kernels.friction import freeze_friction
from lariat.rod.kernels.memory import (
    bounded,
    lane_count,
    load3,
    load4,
    load_lane3,
    load_lane4,
    store,
    store_lane,
)
from lariat.rod.kernels.rotations import rotated, rotation_matrix
from lariat.rod.kernels.types import Doubles, Integers, Matrices33
from lariat.rod.launch.codes import Task
from lariat.rod.launch.layout import HISTORY_SLOTS, LANE_COUNT, Header, Scalar, Section


@ti.real_func
def accept_iterate(
    ni: Integers,
    w: Doubles,
    w33: Matrices33,
    task: ti.i32,
    rod: ti.i32,
    step: ti.i32,
    arg: ti.i32,
    real: ti.f64,
) -> ti.f64:
    """Set the right-hand side to the negative gradient, and store the iterate of a line search.

    Return the change of the energy by friction, whose limits are those of the stored iterate.

    Args:
        arg: Whether there is a line search, whose steps start from the iterate that is stored.
    """
    result = 0.0
    if task == Task.ACCEPT_ITERATE:
        n = ni[Header.NODES]
        if ni[Header.FRICTION_PAIRS] > 0:
            result = freeze_friction(ni, w, rod)
        if arg == 1:
            for k in range(3 * n):
                w[rod + ni[Section.ACCEPTED_POSITIONS] + k] = w[
                    position_at(ni, rod, step + HISTORY_SLOTS, 0) + k
                ]
            for k in range(4 * (n - 1)):
                w[rod + ni[Section.ACCEPTED_ORIENTATIONS] + k] = w[
                    orientation_at(ni, rod, step + HISTORY_SLOTS, 0) + k
                ]
        g = bounded(rod + ni[Section.GRADIENT])
        d = bounded(rod + ni[Section.NEWTON_STEP])
        for k in range(3 * ni[Header.FIRST_FREE], 3 * ni[Header.END_FREE]):
            w[d + k] = -w[g + k]
        for k in range(3 * ni[Header.FIRST_FREE]):
            w[d + k] = 0.0
        for k in range(3 * ni[Header.END_FREE], 3 * (2 * n - 1)):
            w[d + k] = 0.0
    else:
        result = edge_energy(ni, w, w33, task, rod, step, arg, real)
    return result


@ti.real_func
def apply_step(
    ni: Integers,
    w: Doubles,
    w33: Matrices33,
    task: ti.i32,
    rod: ti.i32,
    step: ti.i32,
    arg: ti.i32,
    real: ti.f64,
) -> ti.f64:
    """Move the iterate by `real` * step; the tensions follow linearly.

    Args:
        arg: Whether there is a line search, in which the step starts from the stored iterate.
    """
    result = 0.0
    if task == Task.APPLY_STEP:
        share = real
        n = ni[Header.NODES]
        d = rod + ni[Section.NEWTON_STEP]
        stretch = scalar(ni, w, rod, Scalar.STRETCH_STIFFNESS)
        stretch_per_length = stretch / scalar(ni, w, rod, Scalar.EDGE_LENGTH)
        lanes = bounded(rod + ni[Section.LANES])
        positions = position_at(ni, rod, step + HISTORY_SLOTS, 0)
        orientations = orientation_at(ni, rod, step + HISTORY_SLOTS, 0)
        tensions = rod + ni[Section.TENSIONS]
        start = positions
        turned = orientations
        if arg == 1:
            start = rod + ni[Section.ACCEPTED_POSITIONS]
            turned = rod + ni[Section.ACCEPTED_ORIENTATIONS]
        for strip in range((n - 1 + LANE_COUNT - 1) // LANE_COUNT):
            first = LANE_COUNT * strip
            count = ti.min(LANE_COUNT, n - 1 - first)
            for k in range(count + 1):
                i = first + k
                x = load3(w, start + 3 * i)
                store_lane(w, lanes + k, 0, x + share * load3(w, d + 6 * i))
                if k < count:
                    q = load4(w, turned + 4 * i)
                    store_lane(w, lanes + k, 3, q)
                    store_lane(w, lanes + k, 7, share * load3(w, d + 6 * i + 3))
            for k in range(lane_count(count)):
                at = lanes + k
                q = load_lane4(w, at, 3)
                phi = load_lane3(w, at, 7)
                edge = load_lane3(w, at + 1, 0) - load_lane3(w, at, 0)
                d3 = rotation_matrix(q) @ ti.Vector([phi[1], -phi[0], 1.0])
                store_lane(w, at, 10, stretch_per_length * edge - stretch * d3)
                store_lane(w, at, 13, rotated(q, phi))
            for k in range(count):
                i = first + k
                at = lanes + k
                store(w, positions + 3 * i, load_lane3(w, at, 0))
                store(w, tensions + 3 * i, load_lane3(w, at, 10))
                store(w, orientations + 4 * i, load_lane4(w, at, 13))
        x = load3(w, start + 3 * n - 3)
        store(w, positions + 3 * n - 3, x + share * load3(w, d + 6 * n - 6))
    else:
        result = accept_iterate(ni, w, w33, task, rod, step, arg, real)
    return result
