"""Drawing of marker plates: flat squares with a pattern of cells."""

from lariat.kernel_cache.language import ti
from lariat.simulation.camera.kernels.depths import BLOCK_SHIFT, DRAWN, FAR, NEAR
from lariat.simulation.camera.kernels.rays import (
    images_f32,
    marks_u8,
    rotation_of,
    rows_f64,
    vector_f64,
)

SUPERSAMPLING = 3
"""Rays of a pixel along each axis, which place the edges of cells within a pixel."""
PLATE_DEPTH_MARGIN = 0.0015
"""Depth by which a face may lie in front of a plate without hiding it [m]."""


@ti.kernel
def draw_plates(
    color: ti.types.ndarray(dtype=ti.u8, ndim=2),
    z_buffer: images_f32,
    marks: marks_u8,
    camera: vector_f64,
    plates: rows_f64,
    patterns: ti.types.ndarray(dtype=ti.u8, ndim=3),
):
    """Draw plates over an image.

    Args:
        color: (H, 3 W): red, green and blue of each pixel.
        z_buffer: (H, W) [m].
        marks: (H, W / block, rounded up): `DRAWN` is written where something is drawn.
        camera: fx, fy, cx, cy, R_world_camera by rows (9), position (3) [pixels, m].
        plates: (m, 10): centre, x axis, y axis, half the side [m]; the face looks along x cross y.
        patterns: (m, c, c): grey values of the cells, first row at +y, first column at -x.
    """
    height = z_buffer.shape[0]
    width = z_buffer.shape[1]
    fx, fy, cx, cy = camera[0], camera[1], camera[2], camera[3]
    R = rotation_of(camera)
    eye = ti.Vector([camera[13], camera[14], camera[15]], dt=ti.f64)
    cells = patterns.shape[1]
    ti.loop_config(serialize=True)
    for _ in range(1):
        for m in range(plates.shape[0]):
            centre = ti.Vector([plates[m, 0], plates[m, 1], plates[m, 2]], dt=ti.f64)
            x = ti.Vector([plates[m, 3], plates[m, 4], plates[m, 5]], dt=ti.f64)
            y = ti.Vector([plates[m, 6], plates[m, 7], plates[m, 8]], dt=ti.f64)
            half = plates[m, 9]
            normal = x.cross(y)
            above = normal.dot(eye - centre)
            # In the optical frame from here on.
            p = R.transpose() @ (centre - eye)
            reach = 1.5 * half
            if above > 0.0 and p[2] - reach > NEAR:
                u0, v0, u1, v1 = FAR, FAR, -FAR, -FAR
                for k in range(4):
                    corner = (2.0 * (k % 2) - 1.0) * x + (2.0 * (k // 2) - 1.0) * y
                    q = p + half * (R.transpose() @ corner)
                    u, v = fx * q[0] / q[2] + cx, fy * q[1] / q[2] + cy
                    u0, u1 = ti.min(u0, u), ti.max(u1, u)
                    v0, v1 = ti.min(v0, v), ti.max(v1, v)
                for v in range(
                    ti.cast(ti.max(0.0, v0), ti.i32),
                    ti.cast(ti.min(height - 1.0, v1 + 1.0), ti.i32) + 1,
                ):
                    for u in range(
                        ti.cast(ti.max(0.0, u0), ti.i32),
                        ti.cast(ti.min(width - 1.0, u1 + 1.0), ti.i32) + 1,
                    ):
                        covered = 0.0
                        bright = 0.0
                        nearest = 0.0
                        lit = 0.0
                        for k in range(SUPERSAMPLING * SUPERSAMPLING):
                            du = (k % SUPERSAMPLING + 0.5) / SUPERSAMPLING - 0.5
                            dv = (k // SUPERSAMPLING + 0.5) / SUPERSAMPLING - 0.5
                            ray = ti.Vector(
                                [(u + du - cx) / fx, (v + dv - cy) / fy, 1.0], dt=ti.f64
                            )
                            d = R @ ray
                            down = -normal.dot(d)
                            if down > 1e-9:
                                z = above / down
                                there = eye + z * d - centre
                                a, b = x.dot(there) / half, y.dot(there) / half
                                if ti.abs(a) < 1.0 and ti.abs(b) < 1.0:
                                    column = ti.cast((a + 1.0) / 2.0 * cells, ti.i32)
                                    row = ti.cast((1.0 - b) / 2.0 * cells, ti.i32)
                                    covered += 1.0
                                    bright += patterns[m, row, column]
                                    nearest += z
                                    lit += 0.4 + 0.6 * down / d.norm()
                        if covered > 0.0:
                            z = nearest / covered
                            if z < z_buffer[v, u] + PLATE_DEPTH_MARGIN:
                                marks[v, u >> BLOCK_SHIFT] = ti.u8(DRAWN)
                                part = covered / (SUPERSAMPLING * SUPERSAMPLING)
                                grey = bright / covered * lit / covered
                                for c in ti.static(range(3)):
                                    value = (1.0 - part) * color[v, 3 * u + c] + part * grey
                                    color[v, 3 * u + c] = ti.cast(value, ti.u8)
                                if part > 0.5:
                                    z_buffer[v, u] = ti.f32(z)
