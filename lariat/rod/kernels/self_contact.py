"""The rod's contact with itself.

A touch pushes a point of one edge and the nearest of another apart, along the line between them.
It couples nodes that are far apart in the band: the Hessian gets c u u^T, where u has the normal
at four nodes. So few touches at a time are kept out of the band, and come in with the solve.
"""

import taichi as ti

from lariat.rod.kernels.access import position_at, scalar
from lariat.rod.kernels.banded_solve import factor
from lariat.rod.kernels.contact_penalty import contact_law
from lariat.rod.kernels.rotations import add3, load3, store3
from lariat.rod.kernels.types import Doubles, Integers
from lariat.rod.launch.codes import Task
from lariat.rod.launch.layout import (
    HISTORY_SLOTS,
    SELF_CONTACT_HEAD,
    SELF_CONTACT_WIDTH,
    Header,
    Scalar,
    Section,
)


@ti.real_func
def touches(
    ni: Integers, w: Doubles, task: ti.i32, rod: ti.i32, step: ti.i32, arg: ti.i32, real: ti.f64
) -> ti.f64:
    """Penalty of every point of an edge that comes near another edge, and the list of these.

    Of neighbouring edges that a point comes near it touches only the nearest: a strand is as
    smooth at its nodes as between them. Every pair counts from both sides, by half.
    """
    result = 0.0
    if task == Task.SELF_CONTACT:
        n = ni[Header.NODES]
        samples = ni[Header.SELF_CONTACT_SAMPLES]
        most = ni[Header.MAX_SELF_CONTACTS]
        length = scalar(ni, w, rod, Scalar.EDGE_LENGTH)
        # Between centre lines: two radii and one margin.
        margin = scalar(ni, w, rod, Scalar.CONTACT_MARGIN)
        reach = 2.0 * scalar(ni, w, rod, Scalar.CONTACT_REACH) - margin
        share = 0.5 * length / samples
        longest = 0.0
        for i in range(n - 1):
            edge = load3(w, position_at(ni, rod, step + HISTORY_SLOTS, i + 1)) - load3(
                w, position_at(ni, rod, step + HISTORY_SLOTS, i)
            )
            longest = ti.max(longest, edge.norm())
        gap = ni[Header.SELF_CONTACT_GAP]
        g = rod + ni[Section.GRADIENT]
        head = rod + ni[Section.SELF_CONTACTS]
        count = 0
        lost = 0
        total = 0.0
        for k in range(samples * (n - 1)):
            i = k // samples
            s = (k % samples + 0.5) / samples
            start = load3(w, position_at(ni, rod, step + HISTORY_SLOTS, i))
            point = start + s * (
                load3(w, position_at(ni, rod, step + HISTORY_SLOTS, i + 1)) - start
            )
            nearest = 1e30
            touched = 0
            place = 0.0
            # Neighbours along the rod are no others: those before, then those after.
            for side in range(2):
                j = side * (i + gap)
                stop = n - 1
                if side == 0:
                    stop = i - gap + 1
                # One more round leaves the last run of edges.
                while j <= stop:
                    leave = 1
                    stride = 1
                    if j < stop:
                        a = load3(w, position_at(ni, rod, step + HISTORY_SLOTS, j))
                        along = load3(w, position_at(ni, rod, step + HISTORY_SLOTS, j + 1)) - a
                        away = point - a
                        t = ti.min(ti.max(away.dot(along) / along.dot(along), 0.0), 1.0)
                        distance = (away - t * along).norm()
                        if distance < reach:
                            leave = 0
                            if distance < nearest:
                                nearest = distance
                                touched = j
                                place = t
                        else:
                            # At least so much further along the rod is the next that could.
                            stride = ti.max(1, ti.cast((distance - reach) / longest, ti.i32))
                    if leave == 1 and nearest < reach:
                        if count < most:
                            b = load3(w, position_at(ni, rod, step + HISTORY_SLOTS, touched))
                            along = (
                                load3(w, position_at(ni, rod, step + HISTORY_SLOTS, touched + 1))
                                - b
                            )
                            normal = (point - b - place * along) / (nearest + 1e-15)
                            energy, force, slope = contact_law(ni, w, rod, reach - nearest)
                            total += share * energy
                            pull = -share * force * normal
                            add3(w, g + 6 * i, (1.0 - s) * pull)
                            add3(w, g + 6 * i + 6, s * pull)
                            add3(w, g + 6 * touched, (place - 1.0) * pull)
                            add3(w, g + 6 * touched + 6, -place * pull)
                            inside = ti.cast(place > 0.0 and place < 1.0, ti.f64)
                            over = inside / along.norm()
                            entry = head + SELF_CONTACT_HEAD + SELF_CONTACT_WIDTH * count
                            w[entry] = i
                            w[entry + 1] = touched
                            w[entry + 2] = s
                            w[entry + 3] = place
                            store3(w, entry + 4, normal)
                            w[entry + 7] = 1.0 / (share * slope + 1e-12)
                            store3(w, entry + 8, over * along)
                            w[entry + 11] = over
                            w[entry + 12] = nearest
                            w[entry + 13] = share * force
                            count += 1
                        else:
                            lost += 1
                        nearest = 1e30
                    j += stride
        w[head] = count
        w[head + 1] = lost
        result = total
    else:
        result = factor(ni, w, task, rod, step, arg, real)
    return result
