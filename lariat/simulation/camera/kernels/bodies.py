"""Drawing of obstacles.

Rays have unit depth, so the ray parameter of a hit is its depth. Geometry is in double precision,
because the discriminants of quadratics cancel; images are in single precision.
"""

from lariat.kernel_cache.language import ti
from lariat.shapes import ShapeCode
from lariat.simulation.camera.kernels.depths import BLOCK_SHIFT, DRAWN, FAR, NEAR
from lariat.simulation.camera.kernels.rays import (
    images_f32,
    marks_u8,
    rotate,
    rotation_of,
    rows_f64,
    sphere_hit,
    vector_f64,
)


@ti.func
def body_hit(shape: ti.i32, o, d, a: ti.f64, b: ti.f64, c: ti.f64):
    """Return depth and outward normal where the ray o + z d enters a bounded obstacle.

    The ray is in the frame of the obstacle; the depth is `FAR` if it misses.

    Shapes and sizes as in `lariat.geometry.obstacles.pack`.
    """
    z = FAR
    n = ti.Vector([0.0, 0.0, 1.0], dt=ti.f64)
    if shape == ShapeCode.BOX:
        enter = -FAR
        leave = FAR
        half = ti.Vector([a, b, c], dt=ti.f64)
        for k in ti.static(range(3)):
            if ti.abs(d[k]) < 1e-12:
                if ti.abs(o[k]) > half[k]:
                    enter = FAR
            else:
                side = 1.0 if d[k] > 0.0 else -1.0
                first = (-side * half[k] - o[k]) / d[k]
                last = (side * half[k] - o[k]) / d[k]
                if first > enter:
                    enter = first
                    n = ti.Vector([0.0, 0.0, 0.0], dt=ti.f64)
                    n[k] = -side
                leave = ti.min(leave, last)
        if enter < leave and enter > NEAR:
            z = enter
    elif shape == ShapeCode.SPHERE:
        z = sphere_hit(o, d, a)
        n = (o + z * d) / a
    elif shape == ShapeCode.CONE:
        slope = a / (2.0 * b)
        w = b - o[2]
        dd = d[0] * d[0] + d[1] * d[1] - slope * slope * d[2] * d[2]
        od = o[0] * d[0] + o[1] * d[1] + slope * slope * w * d[2]
        h = od * od - dd * (o[0] * o[0] + o[1] * o[1] - slope * slope * w * w)
        if h > 0.0 and ti.abs(dd) > 1e-12:
            for k in range(2):
                side = (-od + (2.0 * k - 1.0) * ti.sqrt(h)) / dd
                p = o + side * d
                if side > NEAR and side < z and ti.abs(p[2]) <= b:
                    z = side
                    n = ti.Vector([p[0], p[1], slope * slope * (b - p[2])], dt=ti.f64).normalized()
        if ti.abs(d[2]) > 1e-12:
            disc = (-b - o[2]) / d[2]
            p = o + disc * d
            if disc > NEAR and disc < z and p[0] * p[0] + p[1] * p[1] <= a * a:
                z = disc
                n = ti.Vector([0.0, 0.0, -1.0], dt=ti.f64)
    else:
        # The wall of a cylinder or of a capsule, then its ends.
        dd = d[0] * d[0] + d[1] * d[1]
        od = o[0] * d[0] + o[1] * d[1]
        h = od * od - dd * (o[0] * o[0] + o[1] * o[1] - a * a)
        if h > 0.0 and dd > 1e-12:
            wall = (-od - ti.sqrt(h)) / dd
            p = o + wall * d
            if wall > NEAR and ti.abs(p[2]) <= b:
                z = wall
                n = ti.Vector([p[0] / a, p[1] / a, 0.0], dt=ti.f64)
        for k in range(2):
            side = 2.0 * k - 1.0
            end = ti.Vector([0.0, 0.0, side * b], dt=ti.f64)
            if shape == ShapeCode.CAPSULE:
                cap = sphere_hit(o - end, d, a)
                if cap < z:
                    z = cap
                    n = (o + z * d - end) / a
            elif ti.abs(d[2]) > 1e-12:
                disc = (side * b - o[2]) / d[2]
                p = o + disc * d
                if disc > NEAR and disc < z and p[0] * p[0] + p[1] * p[1] <= a * a:
                    z = disc
                    n = ti.Vector([0.0, 0.0, side], dt=ti.f64)
    return z, n


@ti.kernel
def draw_bodies(
    color: ti.types.ndarray(dtype=ti.u8, ndim=2),
    z_buffer: images_f32,
    marks: marks_u8,
    camera: vector_f64,
    bodies: rows_f64,
    body_colors: rows_f64,
):
    """Draw obstacles over an image.

    Args:
        color: (H, 3 W): red, green and blue of each pixel.
        z_buffer: (H, W) [m].
        marks: (H, W / block, rounded up): `DRAWN` is written where something is drawn.
        camera: fx, fy, cx, cy, R_world_camera by rows (9), position (3) [pixels, m].
        bodies: Packed obstacles (m, 12).
        body_colors: (m, 3) in 0..255.
    """
    height = z_buffer.shape[0]
    width = z_buffer.shape[1]
    fx, fy, cx, cy = camera[0], camera[1], camera[2], camera[3]
    R = rotation_of(camera)
    eye = ti.Vector([camera[13], camera[14], camera[15]], dt=ti.f64)
    ti.loop_config(serialize=True)
    for _ in range(1):
        for m in range(bodies.shape[0]):
            shape = ti.cast(bodies[m, 0], ti.i32)
            centre = ti.Vector([bodies[m, 1], bodies[m, 2], bodies[m, 3]], dt=ti.f64)
            q = ti.Vector([bodies[m, 4], bodies[m, 5], bodies[m, 6], bodies[m, 7]], dt=ti.f64)
            a, b, c = bodies[m, 8], bodies[m, 9], bodies[m, 10]
            if shape == ShapeCode.HALF_SPACE:
                # The product of normal and ray is affine in the pixel: one division for each pixel.
                n = rotate(q, ti.Vector([a, b, c], dt=ti.f64))
                above = n.dot(eye - centre)
                nc = R.transpose() @ n
                slope = ti.f32(nc[0] / fx)
                start = nc[2] - nc[0] * cx / fx - nc[1] * cy / fy
                tint = ti.Vector(
                    [
                        ti.f32(body_colors[m, 0]),
                        ti.f32(body_colors[m, 1]),
                        ti.f32(body_colors[m, 2]),
                    ]
                )
                if above > 0.0:
                    for v in range(height):
                        row = ti.f32(start + nc[1] / fy * v)
                        for u in range(width):
                            along = row + slope * u
                            if along < -1e-6:
                                z = ti.f32(-above) / along
                                if z < z_buffer[v, u] and z > ti.f32(NEAR):
                                    z_buffer[v, u] = z
                                    marks[v, u >> BLOCK_SHIFT] = ti.u8(DRAWN)
                                    for k in ti.static(range(3)):
                                        color[v, 3 * u + k] = ti.cast(tint[k], ti.u8)
            else:
                back = ti.Vector([q[0], -q[1], -q[2], -q[3]], dt=ti.f64)
                # Half extents of the box around the obstacle.
                hx, hy, hz = a, b, c
                if shape == ShapeCode.CYLINDER or shape == ShapeCode.CONE:
                    hx, hy, hz = a, a, b
                elif shape == ShapeCode.SPHERE:
                    hx, hy, hz = a, a, a
                elif shape == ShapeCode.CAPSULE:
                    hx, hy, hz = a, a, a + b
                u0, v0, u1, v1 = FAR, FAR, -FAR, -FAR
                for corner in range(8):
                    offset = ti.Vector(
                        [
                            hx * (2.0 * (corner & 1) - 1.0),
                            hy * (2.0 * ((corner >> 1) & 1) - 1.0),
                            hz * (2.0 * (corner >> 2) - 1.0),
                        ],
                        dt=ti.f64,
                    )
                    p = R.transpose() @ (centre + rotate(q, offset) - eye)
                    if p[2] < NEAR:
                        # Behind or around the camera: every pixel may see it.
                        u0, v0, u1, v1 = 0.0, 0.0, FAR, FAR
                    else:
                        u0 = ti.min(u0, fx * p[0] / p[2] + cx)
                        v0 = ti.min(v0, fy * p[1] / p[2] + cy)
                        u1 = ti.max(u1, fx * p[0] / p[2] + cx)
                        v1 = ti.max(v1, fy * p[1] / p[2] + cy)
                o = rotate(back, eye - centre)
                # Rays of a pixel further right, a pixel further down, and along the optical axis.
                right = rotate(back, ti.Vector([R[0, 0], R[1, 0], R[2, 0]], dt=ti.f64)) / fx
                down = rotate(back, ti.Vector([R[0, 1], R[1, 1], R[2, 1]], dt=ti.f64)) / fy
                ahead = rotate(back, ti.Vector([R[0, 2], R[1, 2], R[2, 2]], dt=ti.f64))
                for v in range(
                    ti.max(0, ti.cast(ti.floor(ti.max(v0, -1.0)), ti.i32)),
                    ti.min(height, ti.cast(ti.min(v1, 1e5), ti.i32) + 2),
                ):
                    row = ahead + (v - cy) * down
                    for u in range(
                        ti.max(0, ti.cast(ti.floor(ti.max(u0, -1.0)), ti.i32)),
                        ti.min(width, ti.cast(ti.min(u1, 1e5), ti.i32) + 2),
                    ):
                        d = row + (u - cx) * right
                        z, n = body_hit(shape, o, d, a, b, c)
                        if z < z_buffer[v, u]:
                            z_buffer[v, u] = ti.f32(z)
                            marks[v, u >> BLOCK_SHIFT] = ti.u8(DRAWN)
                            lit = 0.4 + 0.6 * ti.max(0.0, -n.dot(d)) / d.norm()
                            for k in ti.static(range(3)):
                                color[v, 3 * u + k] = ti.cast(body_colors[m, k] * lit, ti.u8)
