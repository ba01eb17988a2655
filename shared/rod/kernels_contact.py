# type: ignore
"""Signed distances with normals and curvatures inside kernels.

The twin of `shared.geometry.obstacles.signed_distance`, on rows of `layout.OBSTACLE_WIDTH`.
"""

import taichi as ti

from shared.rod.kernels_math import load3, load33
from shared.rod.kernels_types import Doubles, Matrix3, Vector3


@ti.real_func
def signed_distance(w: Doubles, at: ti.i32, point: Vector3) -> tuple[ti.f64, Vector3, Matrix3]:
    """Distance [m], unit normal and Hessian [1/m] of obstacle row `at` at a point."""
    shape = ti.cast(w[at], ti.i32)
    turn = load33(w, at + 4)
    p = turn.transpose() @ (point - load3(w, at + 1))
    size = load3(w, at + 13)
    distance = 0.0
    normal = ti.Vector([0.0, 0.0, 1.0])
    bend = ti.Matrix.zero(ti.f64, 3, 3)
    eye = ti.Matrix.identity(ti.f64, 3)
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
        for k in ti.static(range(3)):
            excess = ti.abs(p[k]) - size[k]
            side = 1.0
            if p[k] < 0.0:
                side = -1.0
            if excess > 0.0:
                out[k] = side * excess
                active[k] = 1.0
            if excess > deepest:
                deepest = excess
                face = ti.Vector([0.0, 0.0, 0.0])
                face[k] = side
        if deepest > 0.0:
            distance = out.norm()
            normal = out / distance
            bend = -normal.outer_product(normal)
            for k in ti.static(range(3)):
                bend[k, k] += active[k]
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
        bend = eye - normal.outer_product(normal)
        if shape == 3 and ti.abs(p[2]) < half:
            bend[2, 2] -= 1.0
        bend /= rho
    return distance, turn @ normal, turn @ bend @ turn.transpose()
