"""What contact costs."""

import taichi as ti

from lariat.rod.kernels.access import scalar
from lariat.rod.launch.layout import Scalar


@ti.func
def contact_law(ni: ti.template(), w: ti.template(), rod, depth):
    """Energy, force and stiffness of a penalty that is smooth at first touch."""
    stiffness = scalar(ni, w, rod, Scalar.CONTACT_STIFFNESS)
    margin = scalar(ni, w, rod, Scalar.CONTACT_MARGIN)
    rest = depth - margin
    soft = depth < margin
    energy = ti.select(
        soft,
        depth * depth * depth / (6.0 * margin),
        0.5 * rest * rest + 0.5 * margin * rest + margin * margin / 6.0,
    )
    force = ti.select(soft, depth * depth / (2.0 * margin), depth - 0.5 * margin)
    slope = ti.select(soft, depth / margin, 1.0)
    return stiffness * energy, stiffness * force, stiffness * slope
