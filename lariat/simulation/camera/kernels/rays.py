"""Types, limits and functions shared by the camera's kernels."""

from lariat.kernel_cache.language import ti
from lariat.simulation.camera.kernels.depths import FAR, NEAR

images_f32 = ti.types.ndarray(dtype=ti.f32, ndim=2)
marks_u8 = ti.types.ndarray(dtype=ti.u8, ndim=2)
rows_f64 = ti.types.ndarray(dtype=ti.f64, ndim=2)
vector_f64 = ti.types.ndarray(dtype=ti.f64, ndim=1)


@ti.func
def sphere_hit(o, d, r):
    """Depth at which the ray o + z d enters a sphere about the origin; `FAR` if it misses."""
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
def rotate(q, v):
    """R(q) v of a unit quaternion q, wxyz."""
    w = ti.Vector([q[1], q[2], q[3]], dt=ti.f64)
    t = 2.0 * w.cross(v)
    return v + q[0] * t + w.cross(t)


@ti.func
def rotation_of(camera: ti.template()):
    """R_world_camera of a packed camera."""
    return ti.Matrix(
        [
            [camera[4], camera[5], camera[6]],
            [camera[7], camera[8], camera[9]],
            [camera[10], camera[11], camera[12]],
        ],
        dt=ti.f64,
    )
