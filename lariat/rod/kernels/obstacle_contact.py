"""Contact with obstacles: energy, gradient and Hessian of the penalty.

Every edge has evenly spaced samples x_s, each of which stands for a share l / count of its length:

    sum over samples  l / count p(reach - distance(x_s)),  reach = radius of the rod + margin.

An obstacle is skipped when the box around the rod is out of reach of it, an edge when its middle is
too far away for any of its points to be in reach.
"""

from lariat.kernel_cache.language import ti
from lariat.rod.kernels.addressing import hessian_at, position_at, scalar
from lariat.rod.kernels.contact_penalty import contact_penalty
from lariat.rod.kernels.friction import friction_energy, update_slips
from lariat.rod.kernels.memory import add, add33, load3, load33, store, store33
from lariat.rod.kernels.self_contact import self_contacts
from lariat.rod.kernels.signed_distance import local_distance
from lariat.rod.kernels.types import Doubles, Integers, Matrices33
from lariat.rod.launch.codes import FrictionMode, HessianPart, Task
from lariat.rod.launch.layout import (
    FRICTION_CONTACT_WIDTH,
    FRICTION_HEAD,
    HISTORY_SLOTS,
    OBSTACLE_WIDTH,
    FrictionContact,
    Header,
    ObstacleRow,
    Scalar,
    Section,
)
from lariat.shapes import ShapeCode


@ti.real_func
def obstacle_contacts(
    ni: Integers,
    w: Doubles,
    w33: Matrices33,
    task: ti.i32,
    rod: ti.i32,
    step: ti.i32,
    arg: ti.i32,
    real: ti.f64,
) -> ti.f64:
    """Add energy, gradient and Hessian of contact with obstacles, at samples of every edge.

    Args:
        arg: `HessianPart` to add; the positive one is semidefinite.
    """
    result = 0.0
    updates = task == Task.UPDATE_STATE and ni[Header.FRICTION_PAIRS] > 0
    if task == Task.OBSTACLE_CONTACT or updates:
        exact = arg != HessianPart.POSITIVE
        samples = ni[Header.CONTACT_SAMPLES]
        length = scalar(ni, w, rod, Scalar.EDGE_LENGTH)
        reach = scalar(ni, w, rod, Scalar.CONTACT_REACH)
        share = length / samples
        total = 0.0
        has_friction = ni[Header.FRICTION_PAIRS] > 0
        touching_pairs = 0
        low = load3(w, position_at(ni, rod, step + HISTORY_SLOTS, ni[Header.FIRST_EDGE]))
        high = low
        for i in range(ni[Header.FIRST_EDGE] + 1, ni[Header.END_EDGE] + 1):
            x = load3(w, position_at(ni, rod, step + HISTORY_SLOTS, i))
            low = ti.min(low, x)
            high = ti.max(high, x)
        for k in range(ni[Header.OBSTACLES]):
            row = ni[Header.OBSTACLE_ROWS] + OBSTACLE_WIDTH * k
            place = load3(w, row + ObstacleRow.POSITION)
            gap = ti.max(low, ti.min(high, place)) - place
            within = reach + w[row + ObstacleRow.BOUNDING_RADIUS]
            touching = gap.dot(gap) < within * within
            # Read once: inside the loops, a store might have changed them.
            shape = ti.cast(w[row + ObstacleRow.SHAPE], ti.i32)
            rotation = load33(w, row + ObstacleRow.ROTATION)
            size = load3(w, row + ObstacleRow.SIZES)
            coefficient = w[row + ObstacleRow.FRICTION]
            coefficient *= scalar(ni, w, rod, Scalar.FRICTION_FACTOR)
            bounding_radius = w[row + ObstacleRow.BOUNDING_RADIUS]
            if shape == ShapeCode.HALF_SPACE:
                n = rotation @ size
                middle = 0.5 * (low + high) - place
                touching = n.dot(middle) - 0.5 * ti.abs(n).dot(high - low) < reach
            first = ni[Header.FIRST_EDGE]
            for i in range(first, ti.select(touching, ni[Header.END_EDGE], first)):
                start = load3(w, position_at(ni, rod, step + HISTORY_SLOTS, i))
                stop = load3(w, position_at(ni, rod, step + HISTORY_SLOTS, i + 1))
                # Reach of the whole edge, which may be stretched while the iteration runs.
                bound = 0.5 * (stop - start).norm() + reach
                offset = 0.5 * (start + stop) - place
                radius = bounding_radius + bound
                near = offset.dot(offset) < radius * radius
                # The middle comes first (j = -1); the samples follow only if it is near.
                for j in range(-1, ti.select(near, samples, -1)):
                    if near:
                        s = ti.select(j < 0, 0.5, (j + 0.5) / samples)
                        point = start + s * (stop - start)
                        p = rotation.transpose() @ (point - place)
                        there = local_distance(shape, size, p)
                        distance, normal, curvature = there.distance, there.normal, there.hessian
                        depth = reach - distance
                        if j < 0:
                            near = distance < bound
                        elif depth > 0.0:
                            energy, force, stiffness = contact_penalty(ni, w, rod, depth)
                            total += share * energy
                            outward = rotation @ normal
                            pull = -share * force * outward
                            if shape != ShapeCode.HALF_SPACE:
                                curvature = rotation @ curvature @ rotation.transpose()
                            g = rod + ni[Section.GRADIENT] + 6 * i
                            add(w, g, (1.0 - s) * pull)
                            add(w, g + 6, s * pull)
                            if has_friction and coefficient > 0.0:
                                entry = rod + ni[Section.FRICTION_CONTACTS] + FRICTION_HEAD
                                entry += FRICTION_CONTACT_WIDTH * touching_pairs
                                touching_pairs += 1
                                edges = ni[Header.END_EDGE] - first
                                w[entry + FrictionContact.EDGE] = i
                                w[entry + FrictionContact.PLACE] = s
                                pair = (k * edges + i - first) * samples + j
                                w[entry + FrictionContact.PAIR] = pair
                                w[entry + FrictionContact.COEFFICIENT] = coefficient
                                w[entry + FrictionContact.NORMAL_FORCE] = share * force
                                w[entry + FrictionContact.NORMAL_STIFFNESS] = share * stiffness
                                store(w, entry + FrictionContact.NORMAL, outward)
                                store33(w, entry + FrictionContact.CURVATURE, curvature)
                            if arg != HessianPart.NONE:
                                hessian = share * stiffness * outward.outer_product(outward)
                                if exact:
                                    hessian -= (share * force) * curvature
                                m = hessian_at(ni, rod, step, 2 * i)
                                add33(w, m, ((1.0 - s) * (1.0 - s)) * hessian)
                                add33(w, m + 18, (s * (1.0 - s)) * hessian)
                                add33(w, m + 54, (s * s) * hessian)
        if has_friction:
            head = rod + ni[Section.FRICTION_CONTACTS]
            w[head] = touching_pairs
            if updates:
                w[head + 1] = FrictionMode.FINAL
            total += friction_energy(ni, w, rod, step, arg)
            if updates:
                update_slips(ni, w, rod, step)
        result = total
    else:
        result = self_contacts(ni, w, w33, task, rod, step, arg, real)
    return result
