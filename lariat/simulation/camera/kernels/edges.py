"""Noise of the depth sensor at edges, where a pixel sees two depths."""

from lariat.kernel_cache.language import ti
from lariat.simulation.camera.kernels.depths import BLOCK_SHIFT, DRAWN, FAR
from lariat.simulation.camera.kernels.rays import images_f32, marks_u8, vector_f64


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
def disturb_edges(
    depth: ti.types.ndarray(dtype=ti.u16, ndim=2),
    z_buffer: images_f32,
    marks: marks_u8,
    keys: ti.types.ndarray(dtype=ti.u32, ndim=1),
    noise: vector_f64,
):
    """Disturb the depths that the sensor reports at edges, and take away those of nothing.

    Only marked blocks and the neighbours of drawn ones are searched: most of an image has no edges.

    Args:
        depth: (H, W) [mm], changed; 0 where nothing was measured.
        z_buffer: (H, W), exact [m].
        marks: (H, W / block, rounded up): `STILL` where the image of what stands still has an edge
            or shows nothing, `DRAWN` where something was drawn over it.
        keys: (H,): random bits of each row.
        noise: Quantum and edge step [m], edge mixing and drop-out probabilities [-].
    """
    height = depth.shape[0]
    width = depth.shape[1]
    last_block = marks.shape[1] - 1
    quantum, step = ti.f32(noise[0]), ti.f32(noise[1])
    mixing, dropout = ti.f32(noise[2]), ti.f32(noise[3])
    # Typed constants: a double literal would make the whole pass double precision.
    none, half, one = ti.f32(0.0), ti.f32(0.5), ti.f32(1.0)
    unit, fine, far = ti.f32(1.0 / 1024.0), ti.f32(1000.0), ti.f32(FAR)
    finest, farthest = one / quantum, ti.f32(65535.0)
    ti.loop_config(serialize=True)
    for v in range(height):
        upper = ti.max(v - 1, 0)
        lower = ti.min(v + 1, height - 1)
        for block in range(last_block + 1):
            beside = marks[v, ti.max(block - 1, 0)] | marks[v, ti.min(block + 1, last_block)]
            around = beside | marks[upper, block] | marks[lower, block]
            if (marks[v, block] | (around & DRAWN)) != 0:
                begin = block << BLOCK_SHIFT
                for u in range(begin, ti.min(begin + (1 << BLOCK_SHIFT), width)):
                    z = z_buffer[v, u]
                    left = z_buffer[v, ti.max(u - 1, 0)]
                    right = z_buffer[v, ti.min(u + 1, width - 1)]
                    above = z_buffer[upper, u]
                    below = z_buffer[lower, u]
                    beside_edge = (ti.abs(left - z) > step) | (ti.abs(right - z) > step)
                    across_edge = (ti.abs(above - z) > step) | (ti.abs(below - z) > step)
                    if z >= far:
                        depth[v, u] = ti.cast(0, ti.u16)
                    elif beside_edge | across_edge:
                        bits = mix_bits(keys[v] ^ mix_bits(ti.cast(u + 1, ti.u32)))
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
