"""Types of the arrays of the fit.

Elements of a fixed shape are addressed with fewer instructions than rows of a matrix.
"""

from lariat.kernel_cache.language import ti
from lariat.perception.centerline.bandwidth import BANDWIDTH

matrix_f64 = ti.types.ndarray(dtype=ti.f64, ndim=2)
vector_f64 = ti.types.ndarray(dtype=ti.f64, ndim=1)
vector_i32 = ti.types.ndarray(dtype=ti.i32, ndim=1)
edge_descriptions = ti.types.ndarray(dtype=ti.types.matrix(4, 3, ti.f64), ndim=1)
edge_sums = ti.types.ndarray(dtype=ti.types.matrix(4, 6, ti.f64), ndim=1)
band_rows = ti.types.ndarray(dtype=ti.types.matrix(1, BANDWIDTH, ti.f64), ndim=1)


@ti.func
def node(nodes: ti.template(), i: ti.i32):
    return ti.Vector([nodes[i, 0], nodes[i, 1], nodes[i, 2]], dt=ti.f64)
