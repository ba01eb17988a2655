"""Penalty of contact, whose force and stiffness are continuous at first touch.

For a depth d below the reach, a margin a and a stiffness k,

    p(d) = k d^3 / (6 a)                            d < a
    p(d) = k ((d - a)^2 + a (d - a) + a^2 / 3) / 2    else.
"""

from lariat.kernel_cache.language import ti
from lariat.rod.kernels.addressing import scalar
from lariat.rod.launch.layout import Scalar


@ti.func
def contact_penalty(ni: ti.template(), w: ti.template(), rod, depth):
    """Energy, force and stiffness of contact per length of rod, for a depth below the reach."""
    stiffness = scalar(ni, w, rod, Scalar.CONTACT_STIFFNESS)
    margin = scalar(ni, w, rod, Scalar.CONTACT_MARGIN)
    overlap = depth - margin
    soft = depth < margin
    energy = ti.select(
        soft,
        depth * depth * depth / (6.0 * margin),
        0.5 * overlap * overlap + 0.5 * margin * overlap + margin * margin / 6.0,
    )
    force = ti.select(soft, depth * depth / (2.0 * margin), depth - 0.5 * margin)
    second_derivative = ti.select(soft, depth / margin, 1.0)
    return stiffness * energy, stiffness * force, stiffness * second_derivative
