"""Signed distance from an obstacle with its derivatives, inside of kernels.

The same as `lariat.geometry.obstacles.signed_distance`.
"""

from lariat.kernel_cache.language import ti
from lariat.rod.kernels.memory import load3, load33
from lariat.rod.launch.layout import ObstacleRow
from lariat.shapes import ShapeCode

Vector = ti.types.vector(3, ti.f64)
Distance = ti.types.struct(distance=ti.f64, normal=Vector, hessian=ti.types.matrix(3, 3, ti.f64))
"""Signed distance [m], its gradient and its Hessian [1/m]."""


@ti.real_func
def local_distance(shape: ti.i32, size: Vector, p: Vector) -> Distance:
    """Signed distance of a point from an obstacle, its gradient and its Hessian, in its frame.

    A real function: those that are inlined into real functions cannot branch.

    Args:
        shape: `ShapeCode`.
        size: Sizes of `ObstacleRow`.
        p: Point in the obstacle's frame [m].
    """
    distance = 0.0
    normal = ti.Vector([0.0, 0.0, 1.0])
    hessian = ti.Matrix.zero(ti.f64, 3, 3)
    if shape == ShapeCode.CYLINDER:
        rho = ti.sqrt(p[0] * p[0] + p[1] * p[1]) + 1e-15
        side = ti.select(p[2] < 0.0, -1.0, 1.0)
        radial = ti.Vector([p[0] / rho, p[1] / rho, 0.0])
        around = ti.Vector([-p[1] / rho, p[0] / rho, 0.0])
        axial = ti.Vector([0.0, 0.0, side])
        a = rho - size[0]
        b = ti.abs(p[2]) - size[1]
        if a > 0.0 and b > 0.0:
            distance = ti.sqrt(a * a + b * b)
            normal = (a * radial + b * axial) / distance
            over = (b * radial - a * axial) / distance
            hessian = (a / (distance * rho)) * around.outer_product(around)
            hessian += over.outer_product(over) / distance
        elif a > b:
            distance = a
            normal = radial
            hessian = around.outer_product(around) / rho
        else:
            distance = b
            normal = axial
    elif shape == ShapeCode.BOX:
        out = ti.Vector([0.0, 0.0, 0.0])
        active = ti.Vector([0.0, 0.0, 0.0])
        deepest = -1e30
        face = ti.Vector([0.0, 0.0, 1.0])
        for c in ti.static(range(3)):
            excess = ti.abs(p[c]) - size[c]
            side = ti.select(p[c] < 0.0, -1.0, 1.0)
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
            hessian = -normal.outer_product(normal)
            for c in ti.static(range(3)):
                hessian[c, c] += active[c]
            hessian /= distance
        else:
            distance = deepest
            normal = face
    elif shape == ShapeCode.CONE:
        rho = ti.sqrt(p[0] * p[0] + p[1] * p[1]) + 1e-15
        radial = ti.Vector([p[0] / rho, p[1] / rho, 0.0])
        around = ti.Vector([-p[1] / rho, p[0] / rho, 0.0])
        axial = ti.Vector([0.0, 0.0, 1.0])
        slant = ti.sqrt(size[0] * size[0] + 4.0 * size[1] * size[1])
        outward_z = size[0] / slant
        outward_rho = 2.0 * size[1] / slant
        a = rho - size[0]
        b = p[2] + size[1]
        beyond = outward_rho * a + outward_z * b
        up = outward_rho * b - outward_z * a
        if (ti.max(beyond, -b) <= 0.0 and -b > beyond) or (b < 0.0 and a <= 0.0):
            distance = -b
            normal = -axial
        elif up <= 0.0 and ti.max(beyond, -b) > 0.0:
            distance = ti.sqrt(a * a + b * b)
            normal = (a * radial + b * axial) / distance
            over = (b * radial - a * axial) / distance
            hessian = (a / (distance * rho)) * around.outer_product(around)
            hessian += over.outer_product(over) / distance
        elif up >= slant and beyond > 0.0:
            off = p - ti.Vector([0.0, 0.0, size[1]])
            distance = off.norm()
            normal = off / distance
            hessian = ti.Matrix.identity(ti.f64, 3) - normal.outer_product(normal)
            hessian /= distance
        else:
            distance = beyond
            normal = outward_rho * radial + outward_z * axial
            hessian = (outward_rho / rho) * around.outer_product(around)
    elif shape == ShapeCode.HALF_SPACE:
        normal = size
        distance = p.dot(normal)
    else:  # sphere, capsule
        half = ti.select(shape == ShapeCode.CAPSULE, size[1], 0.0)
        off = p - ti.Vector([0.0, 0.0, ti.min(ti.max(p[2], -half), half)])
        rho = off.norm() + 1e-15
        distance = rho - size[0]
        normal = off / rho
        hessian = ti.Matrix.identity(ti.f64, 3) - normal.outer_product(normal)
        if shape == ShapeCode.CAPSULE and ti.abs(p[2]) < half:
            hessian[2, 2] -= 1.0
        hessian /= rho
    return Distance(distance=distance, normal=normal, hessian=hessian)


@ti.func
def signed_distance(w: ti.template(), row, point):
    """Signed distance of a point from an obstacle, its gradient and its Hessian, world frame.

    Args:
        row: Offset of the obstacle's `ObstacleRow`.
        point: Point in the world frame [m].
    """
    rotation = load33(w, row + ObstacleRow.ROTATION)
    shape = ti.cast(w[row + ObstacleRow.SHAPE], ti.i32)
    p = rotation.transpose() @ (point - load3(w, row + ObstacleRow.POSITION))
    there = local_distance(shape, load3(w, row + ObstacleRow.SIZES), p)
    hessian = rotation @ there.hessian @ rotation.transpose()
    return there.distance, rotation @ there.normal, hessian
