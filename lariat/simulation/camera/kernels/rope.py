"""Drawing of the rope: capsules whose edges are blended into partly covered pixels."""

from lariat.kernel_cache.language import ti
from lariat.simulation.camera.kernels.depths import BLOCK_SHIFT, DRAWN, FAR, NEAR
from lariat.simulation.camera.kernels.rays import (
    images_f32,
    marks_u8,
    rotation_of,
    rows_f64,
    sphere_hit,
    vector_f64,
)


@ti.func
def seen_box(p, q, r: ti.f64, margin: ti.f64, camera: ti.template(), width: ti.i32, height: ti.i32):
    """First column, first row, last column and last row in which a capsule can be seen.

    The capsule of radius r goes from p to q in the optical frame; it is not seen where it comes
    close to the camera. The box is larger by a margin [pixels].
    """
    box = ti.Vector([0, 0, -1, -1])
    nearest = ti.min(p[2], q[2]) - r
    if nearest > NEAR:
        fx, fy, cx, cy = camera[0], camera[1], camera[2], camera[3]
        around = r / nearest * ti.max(fx, fy) + margin
        ua, va = fx * p[0] / p[2] + cx, fy * p[1] / p[2] + cy
        ub, vb = fx * q[0] / q[2] + cx, fy * q[1] / q[2] + cy
        box[0] = ti.cast(ti.max(0.0, ti.min(ua, ub) - around), ti.i32)
        box[1] = ti.cast(ti.max(0.0, ti.min(va, vb) - around), ti.i32)
        box[2] = ti.cast(ti.min(width - 1.0, ti.max(ua, ub) + around), ti.i32)
        box[3] = ti.cast(ti.min(height - 1.0, ti.max(va, vb) + around), ti.i32)
    return box


@ti.kernel
def draw_rope(
    color: ti.types.ndarray(dtype=ti.u8, ndim=2),
    z_buffer: images_f32,
    marks: marks_u8,
    cover: images_f32,
    shade: images_f32,
    camera: vector_f64,
    capsules: rows_f64,
    overlap: ti.f64,
):
    """Draw a chain of capsules over an image.

    Args:
        color: (H, 3 W): red, green and blue of each pixel.
        z_buffer: (H, W) [m].
        marks: (H, W / block, rounded up): `DRAWN` is written where something is drawn.
        cover: (H, W) scratch, share of the pixel that the rope covers, 0 before and after [-].
        shade: (H, W) scratch, cosine between the rope's normal and the ray [-].
        camera: fx, fy, cx, cy, R_world_camera by rows (9), position (3) [pixels, m].
        capsules: (k, 10): both ends of a capsule, its radius and colour [m, 1/255].
        overlap: Depth behind what is drawn already up to which a capsule still covers edge pixels
            [radii].
    """
    height = z_buffer.shape[0]
    width = z_buffer.shape[1]
    fx, fy, cx, cy = camera[0], camera[1], camera[2], camera[3]
    R = rotation_of(camera)
    eye = ti.Vector([camera[13], camera[14], camera[15]], dt=ti.f64)
    ti.loop_config(serialize=True)
    for _ in range(1):
        for s in range(capsules.shape[0]):
            start = ti.Vector([capsules[s, 0], capsules[s, 1], capsules[s, 2]], dt=ti.f64) - eye
            end = ti.Vector([capsules[s, 3], capsules[s, 4], capsules[s, 5]], dt=ti.f64) - eye
            # In the optical frame from here on.
            p = R.transpose() @ start
            q = R.transpose() @ end
            e = q - p
            r = capsules[s, 6]
            box = seen_box(p, q, r, 2.0, camera, width, height)
            ee = e.dot(e)
            oe = -p.dot(e)
            oo = p.dot(p)
            # A ray comes closer than `reach` to the centre where its pixel is partly covered.
            pixel = 0.5 / fx
            reach = (r + pixel * ti.max(p[2], q[2])) / (1.0 - pixel) + 0.5 * ti.sqrt(ee)
            centre = p + 0.5 * e
            beyond = centre.dot(centre) - reach * reach
            for v in range(box[1], box[3] + 1):
                for u in range(box[0], box[2] + 1):
                    d = ti.Vector([(u - cx) / fx, (v - cy) / fy, 1.0], dt=ti.f64)
                    dd = d.dot(d)
                    toward = centre.dot(d)
                    if toward * toward >= beyond * dd:
                        de, od = d.dot(e), -p.dot(d)
                        # Share of the pixel that is rope, by the closest approach of ray and axis.
                        across = dd * ee - de * de
                        t = 0.0
                        if across > 1e-15:
                            t = (dd * oe - de * od) / across
                        t = ti.min(1.0, ti.max(0.0, t))
                        middle = p + t * e
                        zc = middle.dot(d) / dd
                        gap = (middle - zc * d).norm()
                        part = ti.min(1.0, 0.5 + (r - gap) * fx / zc)
                        if part > 0.0:
                            z = FAR
                            cosine = 0.0
                            body = dd * ee - de * de
                            half = ee * od - oe * de
                            h = half * half - body * (ee * oo - oe * oe - r * r * ee)
                            if h >= 0.0 and body > 1e-15:
                                wall = (-half - ti.sqrt(h)) / body
                                along = oe + wall * de
                                if along > 0.0 and along < ee:
                                    z = wall
                                    n = (wall * d - p - along / ee * e) / r
                                    cosine = -n.dot(d)
                            if z >= FAR:
                                for k in range(2):
                                    tip = p + k * e
                                    cap = sphere_hit(-tip, d, r)
                                    if cap < z:
                                        z = cap
                                        cosine = -(z * d - tip).dot(d) / r
                            if zc - r < z_buffer[v, u] + overlap * r or z < z_buffer[v, u]:
                                marks[v, u >> BLOCK_SHIFT] = ti.u8(DRAWN)
                                shaded = cover[v, u] > ti.f32(0.0)
                                if part > cover[v, u]:
                                    cover[v, u] = ti.f32(part)
                                if z < z_buffer[v, u]:
                                    z_buffer[v, u] = ti.f32(z)
                                    # Brightness of the capsule nearest to the camera.
                                    shade[v, u] = ti.f32(cosine / ti.sqrt(dd))
                                elif shaded == 0:
                                    shade[v, u] = ti.f32(0.0)

    ti.loop_config(serialize=True)
    for s in range(capsules.shape[0]):
        start = ti.Vector([capsules[s, 0], capsules[s, 1], capsules[s, 2]], dt=ti.f64) - eye
        end = ti.Vector([capsules[s, 3], capsules[s, 4], capsules[s, 5]], dt=ti.f64) - eye
        # Larger than the box above, however either is rounded: nothing stays in `cover`.
        p, q = R.transpose() @ start, R.transpose() @ end
        box = seen_box(p, q, capsules[s, 6], 3.0, camera, width, height)
        for v in range(box[1], box[3] + 1):
            for u in range(box[0], box[2] + 1):
                part = cover[v, u]
                if part > ti.f32(0.0):
                    # Boxes overlap: each pixel is blended once.
                    cover[v, u] = ti.f32(0.0)
                    lit = part * (0.6 + 0.4 * shade[v, u])
                    for k in ti.static(range(3)):
                        value = color[v, 3 * u + k] * (1.0 - part) + capsules[0, 7 + k] * lit
                        color[v, 3 * u + k] = ti.cast(value, ti.u8)
