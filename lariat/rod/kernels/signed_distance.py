"""Signed distances with normals and curvatures inside kernels.

The twin of `lariat.geometry.obstacles.signed_distance`, on rows of `layout.OBSTACLE_WIDTH`.
"""

import taichi as ti

from lariat.rod.kernels.access import hessian_at, position_at, scalar
from lariat.rod.kernels.contact_penalty import contact_law
from lariat.rod.kernels.rotations import add3, add33, load3, load33
from lariat.rod.kernels.self_contact import touches
from lariat.rod.kernels.types import Doubles, Integers
from lariat.rod.launch.codes import Task
from lariat.rod.launch.layout import HISTORY_SLOTS, OBSTACLE_WIDTH, Header, Scalar, Section


@ti.real_func
def contacts(
    ni: Integers, w: Doubles, task: ti.i32, rod: ti.i32, step: ti.i32, arg: ti.i32, real: ti.f64
) -> ti.f64:
    """Penalty of every obstacle on evenly spaced samples of every edge.

    `arg`: 1 with the whole Hessian, 0 with its definite part, 2 without any.
    """
    result = 0.0
    if task == Task.OBSTACLE_CONTACT:
        exact = arg == 1
        n = ni[Header.NODES]
        samples = ni[Header.CONTACT_SAMPLES]
        length = scalar(ni, w, rod, Scalar.EDGE_LENGTH)
        reach = scalar(ni, w, rod, Scalar.CONTACT_REACH)
        share = length / samples
        total = 0.0
        for k in range(ni[Header.OBSTACLES]):
            row = ni[Header.OBSTACLE_ROWS] + OBSTACLE_WIDTH * k
            for i in range(n - 1):
                start = load3(w, position_at(ni, rod, step + HISTORY_SLOTS, i))
                stop = load3(w, position_at(ni, rod, step + HISTORY_SLOTS, i + 1))
                # Reach of the whole edge, which may be stretched while the iteration runs.
                bound = 0.5 * (stop - start).norm() + reach
                middle = 0.5 * (start + stop)
                near = (middle - load3(w, row + 1)).norm() < w[row + 16] + bound
                # Once for the middle, then for every sample if that came near.
                for j in range(-1, samples):
                    if near:
                        s = ti.select(j < 0, 0.5, (j + 0.5) / samples)
                        point = start + s * (stop - start)
                        shape = ti.cast(w[row], ti.i32)
                        turn = load33(w, row + 4)
                        p = turn.transpose() @ (point - load3(w, row + 1))
                        size = load3(w, row + 13)
                        distance = 0.0
                        normal = ti.Vector([0.0, 0.0, 1.0])
                        bend = ti.Matrix.zero(ti.f64, 3, 3)
                        if shape == 0:
                            rho = ti.sqrt(p[0] * p[0] + p[1] * p[1]) + 1e-15
                            side = 1.0
                            if p[2] < 0.0:
                                side = -1.0
                            radial = ti.Vector([p[0] / rho, p[1] / rho, 0.0])
                            around = ti.Vector([-p[1] / rho, p[0] / rho, 0.0])
                            axial = ti.Vector([0.0, 0.0, side])
                            a = rho - size[0]
                            b = ti.abs(p[2]) - size[1]
                            if a > 0.0 and b > 0.0:
                                distance = ti.sqrt(a * a + b * b)
                                normal = (a * radial + b * axial) / distance
                                over = (b * radial - a * axial) / distance
                                bend = (a / (distance * rho)) * around.outer_product(around)
                                bend += over.outer_product(over) / distance
                            elif a > b:
                                distance = a
                                normal = radial
                                bend = around.outer_product(around) / rho
                            else:
                                distance = b
                                normal = axial
                        elif shape == 1:
                            out = ti.Vector([0.0, 0.0, 0.0])
                            active = ti.Vector([0.0, 0.0, 0.0])
                            deepest = -1e30
                            face = ti.Vector([0.0, 0.0, 1.0])
                            for c in ti.static(range(3)):
                                excess = ti.abs(p[c]) - size[c]
                                side = 1.0
                                if p[c] < 0.0:
                                    side = -1.0
                                if excess > 0.0:
                                    out[c] = side * excess
                                    active[c] = 1.0
                                if excess > deepest:
                                    deepest = excess
                                    face = ti.Vector([0.0, 0.0, 0.0])
                                    face[c] = side
                            if deepest > 0.0:
                                distance = out.norm()
                                normal = out / distance
                                bend = -normal.outer_product(normal)
                                for c in ti.static(range(3)):
                                    bend[c, c] += active[c]
                                bend /= distance
                            else:
                                distance = deepest
                                normal = face
                        elif shape == 4:
                            normal = size
                            distance = p.dot(normal)
                        else:
                            half = 0.0
                            if shape == 3:
                                half = size[1]
                            axis = ti.min(ti.max(p[2], -half), half)
                            off = p - ti.Vector([0.0, 0.0, axis])
                            rho = off.norm() + 1e-15
                            distance = rho - size[0]
                            normal = off / rho
                            bend = ti.Matrix.identity(ti.f64, 3) - normal.outer_product(normal)
                            if shape == 3 and ti.abs(p[2]) < half:
                                bend[2, 2] -= 1.0
                            bend /= rho
                        depth = reach - distance
                        if j < 0:
                            near = distance < bound
                        elif depth > 0.0:
                            energy, force, slope = contact_law(ni, w, rod, depth)
                            total += share * energy
                            outward = turn @ normal
                            pull = -share * force * outward
                            stiff = share * slope * outward.outer_product(outward)
                            if exact:
                                stiff -= share * force * (turn @ bend @ turn.transpose())
                            g = rod + ni[Section.GRADIENT] + 6 * i
                            add3(w, g, (1.0 - s) * pull)
                            add3(w, g + 6, s * pull)
                            if arg < 2:
                                m = hessian_at(ni, rod, step, 2 * i)
                                add33(w, m, ((1.0 - s) * (1.0 - s)) * stiff)
                                add33(w, m + 18, (s * (1.0 - s)) * stiff)
                                add33(w, m + 54, (s * s) * stiff)
        result = total
    else:
        result = touches(ni, w, task, rod, step, arg, real)
    return result
