"""Offsets and constants in the array of doubles.

`ni` is the integer array, `w` the doubles, `rod` the offset of the current rod.
"""

from lariat.kernel_cache.language import ti
from lariat.paper.xpbd.launch.layout import Section


@ti.func
def scalar(ni: ti.template(), w: ti.template(), rod, k):
    """Constant of a rod, named by `Scalar`."""
    return w[rod + ni[Section.SCALARS] + k]


@ti.func
def place(ni: ti.template(), rod, section, index):
    """Offset of an entry of a section."""
    return rod + ni[section] + index
