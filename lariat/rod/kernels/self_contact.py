"""Contact of the rod with itself: energy, gradient and list of contacts.

    sum over points  l / count p(reach - distance) / 2,  reach = diameter + margin

between points of an edge and the nearest point of another edge that is no neighbour, pushed apart
along the line between them. The contacts are few and do not enter the band: the solves apply them
one by one, from the list of their `SelfContact` numbers.
"""

from lariat.kernel_cache.language import ti
from lariat.rod.kernels.addressing import position_at, scalar
from lariat.rod.kernels.banded_factorization import factorize
from lariat.rod.kernels.contact_penalty import contact_penalty
from lariat.rod.kernels.memory import add, load3, store
from lariat.rod.kernels.types import Doubles, Integers, Matrices33
from lariat.rod.launch.codes import Task
from lariat.rod.launch.layout import (
    HISTORY_SLOTS,
    SELF_CONTACT_HEAD,
    SELF_CONTACT_WIDTH,
    Header,
    Scalar,
    Section,
    SelfContact,
)


@ti.real_func
def self_contacts(
    ni: Integers,
    w: Doubles,
    w33: Matrices33,
    task: ti.i32,
    rod: ti.i32,
    step: ti.i32,
    arg: ti.i32,
    real: ti.f64,
) -> ti.f64:
    """Add energy and gradient of self-contact, and list the contacts for the solve.

    A point touches only the nearest edge of another strand, so that a strand is as smooth at its
    nodes as between them. Every pair is counted from both sides, by half each.
    """
    result = 0.0
    if task == Task.SELF_CONTACT:
        first = ni[Header.FIRST_EDGE]
        end = ni[Header.END_EDGE]
        samples = ni[Header.SELF_CONTACT_SAMPLES]
        capacity = ni[Header.MAX_SELF_CONTACTS]
        length = scalar(ni, w, rod, Scalar.EDGE_LENGTH)
        # Between centre lines: two radii and one margin.
        margin = scalar(ni, w, rod, Scalar.CONTACT_MARGIN)
        reach = 2.0 * scalar(ni, w, rod, Scalar.CONTACT_REACH) - margin
        weight = 0.5 * length / samples
        longest = 0.0
        for i in range(first, end):
            edge = load3(w, position_at(ni, rod, step + HISTORY_SLOTS, i + 1)) - load3(
                w, position_at(ni, rod, step + HISTORY_SLOTS, i)
            )
            longest = ti.max(longest, edge.norm())
        gap = ni[Header.SELF_CONTACT_GAP]
        g = rod + ni[Section.GRADIENT]
        head = rod + ni[Section.SELF_CONTACTS]
        count = 0
        unplaced = 0
        total = 0.0
        for k in range(samples * (end - first)):
            i = first + k // samples
            s = (k % samples + 0.5) / samples
            start = load3(w, position_at(ni, rod, step + HISTORY_SLOTS, i))
            point = start + s * (
                load3(w, position_at(ni, rod, step + HISTORY_SLOTS, i + 1)) - start
            )
            nearest = 1e30
            other = 0
            place = 0.0
            # Edges before this one and its neighbours, then those after.
            for side in range(2):
                j = first
                stop = i - gap + 1
                if side == 1:
                    j = i + gap
                    stop = end
                # One round more than there are edges ends the last run of near ones.
                while j <= stop:
                    leave = 1
                    stride = 1
                    if j < stop:
                        a = load3(w, position_at(ni, rod, step + HISTORY_SLOTS, j))
                        along = load3(w, position_at(ni, rod, step + HISTORY_SLOTS, j + 1)) - a
                        offset = point - a
                        t = ti.min(ti.max(offset.dot(along) / along.dot(along), 0.0), 1.0)
                        distance = (offset - t * along).norm()
                        if distance < reach:
                            leave = 0
                            if distance < nearest:
                                nearest = distance
                                other = j
                                place = t
                        else:
                            # No edge within this many further ones is near enough.
                            stride = ti.max(1, ti.cast((distance - reach) / longest, ti.i32))
                    if leave == 1 and nearest < reach:
                        if count < capacity:
                            b = load3(w, position_at(ni, rod, step + HISTORY_SLOTS, other))
                            along = (
                                load3(w, position_at(ni, rod, step + HISTORY_SLOTS, other + 1)) - b
                            )
                            normal = (point - b - place * along) / (nearest + 1e-15)
                            energy, force, stiffness = contact_penalty(ni, w, rod, reach - nearest)
                            total += weight * energy
                            pull = -weight * force * normal
                            add(w, g + 6 * i, (1.0 - s) * pull)
                            add(w, g + 6 * i + 6, s * pull)
                            add(w, g + 6 * other, (place - 1.0) * pull)
                            add(w, g + 6 * other + 6, -place * pull)
                            inside = ti.cast(place > 0.0 and place < 1.0, ti.f64)
                            over = inside / along.norm()
                            entry = head + SELF_CONTACT_HEAD + SELF_CONTACT_WIDTH * count
                            w[entry + SelfContact.EDGE] = i
                            w[entry + SelfContact.OTHER_EDGE] = other
                            w[entry + SelfContact.PLACE] = s
                            w[entry + SelfContact.OTHER_PLACE] = place
                            store(w, entry + SelfContact.NORMAL, normal)
                            w[entry + SelfContact.COMPLIANCE] = 1.0 / (weight * stiffness + 1e-12)
                            store(w, entry + SelfContact.OTHER_DIRECTION, over * along)
                            w[entry + SelfContact.OTHER_INVERSE_LENGTH] = over
                            w[entry + SelfContact.DISTANCE] = nearest
                            w[entry + SelfContact.FORCE] = weight * force
                            count += 1
                        else:
                            unplaced += 1
                        nearest = 1e30
                    j += stride
        w[head] = count
        w[head + 1] = unplaced
        result = total
    else:
        result = factorize(ni, w, w33, task, rod, step, arg, real)
    return result
