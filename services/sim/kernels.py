"""The ray caster and the noise of the simulated RGB-D camera, compiled.

Rays have unit depth, so the parameter of a hit is its depth. Geometry is double precision (a
quadratic's discriminant cancels), images are single.
"""

import taichi as ti

FAR = 1e6
NEAR = 0.02

images_f32 = ti.types.ndarray(dtype=ti.f32, ndim=2)
rows_f64 = ti.types.ndarray(dtype=ti.f64, ndim=2)
vector_f64 = ti.types.ndarray(dtype=ti.f64, ndim=1)


@ti.func
def mix_bits(x: ti.u32) -> ti.u32:
    """A hash with full avalanche (lowbias32, Wellons 2018)."""
    x ^= x >> 16
    x *= ti.u32(0x7FEB352D)
    x ^= x >> 15
    x *= ti.u32(0x846CA68B)
    x ^= x >> 16
    return x


@ti.func
def nearest_of_sphere(o, d, r):
    """Depth at which o + z d enters the sphere about the origin, FAR when it misses."""
    dd = d.dot(d)
    od = o.dot(d)
    h = od * od - dd * (o.dot(o) - r * r)
    z = FAR
    if h > 0.0:
        z = (-od - ti.sqrt(h)) / dd
        if z < NEAR:
            z = FAR
    return z


@ti.func
def body_hit(shape: ti.i32, o, d, a: ti.f64, b: ti.f64, c: ti.f64):
    """Depth and outward normal where the local ray o + z d enters a bounded obstacle.

    Shapes and sizes as in `shared.geometry.obstacles.pack`: 0 cylinder, 1 box, 2 sphere, 3 capsule.
    """
    z = FAR
    n = ti.Vector([0.0, 0.0, 1.0], dt=ti.f64)
    if shape == 1:
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
    elif shape == 2:
        z = nearest_of_sphere(o, d, a)
        n = (o + z * d) / a
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
            if shape == 3:
                cap = nearest_of_sphere(o - end, d, a)
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


@ti.func
def turned(q, v):
    """R(q) v."""
    w = ti.Vector([q[1], q[2], q[3]], dt=ti.f64)
    t = 2.0 * w.cross(v)
    return v + q[0] * t + w.cross(t)


@ti.kernel
def render(
    color: ti.types.ndarray(dtype=ti.u8, ndim=2),
    depth: ti.types.ndarray(dtype=ti.u16, ndim=2),
    z_buffer: images_f32,
    cover: images_f32,
    shade: images_f32,
    gaussian: ti.types.ndarray(dtype=ti.f32, ndim=1),
    camera: vector_f64,
    bodies: rows_f64,
    body_colors: rows_f64,
    chains: rows_f64,
    noise: vector_f64,
    seed: ti.u32,
):
    """One RGB-D frame.

    Args:
        color: (H, 3 W), written: red, green and blue of each pixel.
        depth: (H, W) [mm], written; 0 where nothing was measured.
        z_buffer: (H, W) scratch [m].
        cover: (H, W) scratch, part of the pixel that the rope covers.
        shade: (H, W) scratch, cosine between the rope's normal and the ray.
        gaussian: A table of standard normal numbers, much longer than a row.
        camera: fx, fy, cx, cy, R_world_camera by rows (9), position (3) [pixels, m].
        bodies: Packed obstacles (m, 12).
        body_colors: (m, 3) in 0..255.
        chains: (k, 10): both ends of a capsule, its radius and colour [m, 0..255].
        noise: Background, depth sigma, bias, quantum [m], edge step [m], edge mixing and
            drop-out probabilities.
        seed: Of this frame.
    """
    height = depth.shape[0]
    width = depth.shape[1]
    fx, fy, cx, cy = camera[0], camera[1], camera[2], camera[3]
    R = ti.Matrix(
        [
            [camera[4], camera[5], camera[6]],
            [camera[7], camera[8], camera[9]],
            [camera[10], camera[11], camera[12]],
        ],
        dt=ti.f64,
    )
    eye = ti.Vector([camera[13], camera[14], camera[15]], dt=ti.f64)

    background = ti.cast(noise[0], ti.u8)
    for v in range(height):
        for u in range(width):
            z_buffer[v, u] = ti.f32(FAR)
            cover[v, u] = ti.f32(0.0)
        for j in range(3 * width):
            color[v, j] = background

    for _ in range(1):
        for m in range(bodies.shape[0]):
            shape = ti.cast(bodies[m, 0], ti.i32)
            centre = ti.Vector([bodies[m, 1], bodies[m, 2], bodies[m, 3]], dt=ti.f64)
            q = ti.Vector([bodies[m, 4], bodies[m, 5], bodies[m, 6], bodies[m, 7]], dt=ti.f64)
            a, b, c = bodies[m, 8], bodies[m, 9], bodies[m, 10]
            if shape == 4:
                # The normal's product with a ray is affine in the pixel: one division a pixel.
                n = turned(q, ti.Vector([a, b, c], dt=ti.f64))
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
                                    for k in ti.static(range(3)):
                                        color[v, 3 * u + k] = ti.cast(tint[k], ti.u8)
            else:
                back = ti.Vector([q[0], -q[1], -q[2], -q[3]], dt=ti.f64)
                # Half extents of the local box around the body.
                hx, hy, hz = a, b, c
                if shape == 0:
                    hx, hy, hz = a, a, b
                elif shape == 2:
                    hx, hy, hz = a, a, a
                elif shape == 3:
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
                    p = R.transpose() @ (centre + turned(q, offset) - eye)
                    if p[2] < NEAR:
                        # Beside or around the camera: every pixel may see it.
                        u0, v0, u1, v1 = 0.0, 0.0, FAR, FAR
                    else:
                        u0 = ti.min(u0, fx * p[0] / p[2] + cx)
                        v0 = ti.min(v0, fy * p[1] / p[2] + cy)
                        u1 = ti.max(u1, fx * p[0] / p[2] + cx)
                        v1 = ti.max(v1, fy * p[1] / p[2] + cy)
                o = turned(back, eye - centre)
                for v in range(
                    ti.max(0, ti.cast(ti.floor(ti.max(v0, -1.0)), ti.i32)),
                    ti.min(height, ti.cast(ti.min(v1, 1e5), ti.i32) + 2),
                ):
                    for u in range(
                        ti.max(0, ti.cast(ti.floor(ti.max(u0, -1.0)), ti.i32)),
                        ti.min(width, ti.cast(ti.min(u1, 1e5), ti.i32) + 2),
                    ):
                        ray = ti.Vector([(u - cx) / fx, (v - cy) / fy, 1.0], dt=ti.f64)
                        d = turned(back, R @ ray)
                        z, n = body_hit(shape, o, d, a, b, c)
                        if z < z_buffer[v, u]:
                            z_buffer[v, u] = ti.f32(z)
                            lit = 0.4 + 0.6 * ti.max(0.0, -n.dot(d)) / d.norm()
                            for k in ti.static(range(3)):
                                color[v, 3 * u + k] = ti.cast(body_colors[m, k] * lit, ti.u8)

    for _ in range(1):
        for s in range(chains.shape[0]):
            start = ti.Vector([chains[s, 0], chains[s, 1], chains[s, 2]], dt=ti.f64) - eye
            end = ti.Vector([chains[s, 3], chains[s, 4], chains[s, 5]], dt=ti.f64) - eye
            # From here on in the optical frame.
            p = R.transpose() @ start
            e = R.transpose() @ end - p
            r = chains[s, 6]
            z0 = ti.min(p[2], p[2] + e[2]) - r
            if z0 > NEAR:
                margin = r / z0 * ti.max(fx, fy) + 2.0
                ua, va = fx * p[0] / p[2] + cx, fy * p[1] / p[2] + cy
                ub, vb = (
                    fx * (p[0] + e[0]) / (p[2] + e[2]) + cx,
                    fy * (p[1] + e[1]) / (p[2] + e[2]) + cy,
                )
                ee = e.dot(e)
                oe = -p.dot(e)
                oo = p.dot(p)
                for v in range(
                    ti.cast(ti.max(0.0, ti.min(va, vb) - margin), ti.i32),
                    ti.cast(ti.min(height - 1.0, ti.max(va, vb) + margin), ti.i32) + 1,
                ):
                    for u in range(
                        ti.cast(ti.max(0.0, ti.min(ua, ub) - margin), ti.i32),
                        ti.cast(ti.min(width - 1.0, ti.max(ua, ub) + margin), ti.i32) + 1,
                    ):
                        d = ti.Vector([(u - cx) / fx, (v - cy) / fy, 1.0], dt=ti.f64)
                        dd, de, od = d.dot(d), d.dot(e), -p.dot(d)
                        # Closest approach of ray and axis: how much of the pixel is rope.
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
                                    cap = nearest_of_sphere(-tip, d, r)
                                    if cap < z:
                                        z = cap
                                        cosine = -(z * d - tip).dot(d) / r
                            if zc - r < z_buffer[v, u] + 2.0 * r or z < z_buffer[v, u]:
                                shaded = cover[v, u] > ti.f32(0.0)
                                if part > cover[v, u]:
                                    cover[v, u] = ti.f32(part)
                                if z < z_buffer[v, u]:
                                    z_buffer[v, u] = ti.f32(z)
                                    # The colour's brightness is kept in the sign-free shade.
                                    shade[v, u] = ti.f32(cosine / ti.sqrt(dd))
                                elif shaded == 0:
                                    shade[v, u] = ti.f32(0.0)

    for v in range(height):
        for u in range(width):
            part = cover[v, u]
            if part > ti.f32(0.0):
                lit = part * (0.6 + 0.4 * shade[v, u])
                for k in ti.static(range(3)):
                    value = color[v, 3 * u + k] * (1.0 - part) + chains[0, 7 + k] * lit
                    color[v, 3 * u + k] = ti.cast(value, ti.u8)

    sigma, bias, quantum = ti.f32(noise[1]), ti.f32(noise[2]), ti.f32(noise[3])
    step, mixing, dropout = ti.f32(noise[4]), ti.f32(noise[5]), ti.f32(noise[6])
    last = ti.cast(gaussian.shape[0] - width, ti.u32)
    # Typed constants: a double literal would turn the whole pass into double precision.
    none, half, one = ti.f32(0.0), ti.f32(0.5), ti.f32(1.0)
    unit, fine, far = ti.f32(1.0 / 1024.0), ti.f32(1000.0), ti.f32(FAR)
    finest, farthest = one / quantum, ti.f32(65535.0)
    for v in range(height):
        key = mix_bits(seed ^ mix_bits(ti.cast(v + 1, ti.u32)))
        table = ti.cast(key % last, ti.i32)
        upper = ti.max(v - 1, 0)
        lower = ti.min(v + 1, height - 1)
        # Without branches, so that this loop becomes vector instructions.
        for u in range(width):
            z = z_buffer[v, u]
            value = (z + bias + sigma * gaussian[table + u]) * finest + half
            value = ti.min(farthest, ti.max(none, ti.floor(value) * quantum * fine + half))
            depth[v, u] = ti.cast(value if z < far else none, ti.u16)
        for u in range(width):
            z = z_buffer[v, u]
            left = z_buffer[v, ti.max(u - 1, 0)]
            right = z_buffer[v, ti.min(u + 1, width - 1)]
            above = z_buffer[upper, u]
            below = z_buffer[lower, u]
            widest = ti.max(
                ti.max(ti.abs(left - z), ti.abs(right - z)),
                ti.max(ti.abs(above - z), ti.abs(below - z)),
            )
            if widest > step and z < far:
                bits = mix_bits(key ^ mix_bits(ti.cast(u + 1, ti.u32)))
                other = left
                if (bits & 3) == 1:
                    other = right
                elif (bits & 3) == 2:
                    other = above
                elif (bits & 3) == 3:
                    other = below
                if ti.cast((bits >> 2) & 1023, ti.f32) * unit < dropout:
                    depth[v, u] = ti.cast(0, ti.u16)
                elif ti.cast((bits >> 12) & 1023, ti.f32) * unit < mixing and other < far:
                    mixed = (other - z) * ti.cast((bits >> 22) & 1023, ti.f32) * unit
                    value = ti.floor(mixed * finest + half) * quantum * fine + depth[v, u] + half
                    depth[v, u] = ti.cast(ti.min(farthest, ti.max(none, value)), ti.u16)
