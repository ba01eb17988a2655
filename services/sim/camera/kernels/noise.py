"""Depth noise of the simulated sensor."""

import taichi as ti

from services.sim.camera.kernels.depths import FAR
from services.sim.camera.kernels.rays import (
    images_f32,
    vector_f64,
)

EDGE_BLOCK = 64
"""Number of pixels of a row that are searched for edges together."""


@ti.func
def mix_bits(x: ti.u32) -> ti.u32:
    """Hash with full avalanche (lowbias32, Wellons 2018)."""
    x ^= x >> 16
    x *= ti.u32(0x7FEB352D)
    x ^= x >> 15
    x *= ti.u32(0x846CA68B)
    x ^= x >> 16
    return x


@ti.kernel
def measure_depth(
    depth: ti.types.ndarray(dtype=ti.u16, ndim=2),
    z_buffer: images_f32,
    gaussian: ti.types.ndarray(dtype=ti.f32, ndim=1),
    noise: vector_f64,
    seed: ti.u32,
):
    """Write the depth that the sensor reports.

    Args:
        depth: (H, W) [mm], written; 0 where nothing was measured.
        z_buffer: (H, W), exact [m].
        gaussian: Table of standard normal numbers, much longer than a row.
        noise: Sigma, bias, quantum and edge step [m], edge mixing and drop-out probabilities [-].
        seed: Seed of this frame.
    """
    height = depth.shape[0]
    width = depth.shape[1]
    sigma, bias, quantum = ti.f32(noise[0]), ti.f32(noise[1]), ti.f32(noise[2])
    step, mixing, dropout = ti.f32(noise[3]), ti.f32(noise[4]), ti.f32(noise[5])
    last = ti.cast(gaussian.shape[0] - width, ti.u32)
    # Typed constants: a double literal would make the whole pass double precision.
    none, half, one = ti.f32(0.0), ti.f32(0.5), ti.f32(1.0)
    unit, fine, far = ti.f32(1.0 / 1024.0), ti.f32(1000.0), ti.f32(FAR)
    finest, farthest = one / quantum, ti.f32(65535.0)
    ti.loop_config(serialize=True)
    for v in range(height):
        key = mix_bits(seed ^ mix_bits(ti.cast(v + 1, ti.u32)))
        table = ti.cast(key % last, ti.i32)
        upper = ti.max(v - 1, 0)
        lower = ti.min(v + 1, height - 1)
        # Without branches, so that the loop compiles to vector instructions.
        for u in range(width):
            z = z_buffer[v, u]
            value = (z + bias + sigma * gaussian[table + u]) * finest + half
            value = ti.min(farthest, ti.max(none, ti.floor(value) * quantum * fine + half))
            depth[v, u] = ti.cast(value if z < far else none, ti.u16)
        for block in range((width + EDGE_BLOCK - 1) // EDGE_BLOCK):
            begin = block * EDGE_BLOCK
            end = ti.min(begin + EDGE_BLOCK, width)
            last_u = end - 1
            # Most of an image has no edges; this search compiles to vector instructions, too.
            steepest = ti.max(
                ti.abs(z_buffer[v, ti.max(begin - 1, 0)] - z_buffer[v, begin]),
                ti.max(
                    ti.abs(z_buffer[upper, last_u] - z_buffer[v, last_u]),
                    ti.max(
                        ti.abs(z_buffer[lower, last_u] - z_buffer[v, last_u]),
                        ti.abs(z_buffer[v, ti.min(end, width - 1)] - z_buffer[v, last_u]),
                    ),
                ),
            )
            for u in range(begin, last_u):
                z = z_buffer[v, u]
                vertical = ti.max(ti.abs(z_buffer[upper, u] - z), ti.abs(z_buffer[lower, u] - z))
                steepest = ti.max(steepest, ti.max(ti.abs(z_buffer[v, u + 1] - z), vertical))
            if steepest > step:
                for u in range(begin, end):
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
                            value = (
                                ti.floor(mixed * finest + half) * quantum * fine
                                + depth[v, u]
                                + half
                            )
                            depth[v, u] = ti.cast(ti.min(farthest, ti.max(none, value)), ti.u16)
