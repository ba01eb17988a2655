"""Offsets of positions, orientations and other quantities in the array of doubles.

`ni` is the integer array, `rod` the offset of the current rod.
"""

import taichi as ti

from lariat.rod.launch.codes import Derivatives
from lariat.rod.launch.layout import (
    GROUP_COLUMNS,
    HISTORY_SLOTS,
    MATRIX_WIDTH,
    PARAMETER_WIDTH,
    STEP_BLOCKS,
    TIME_WIDTH,
    Header,
    Section,
)


@ti.func
def position_at(ni: ti.template(), rod, slot, i):
    """Offset of the position of node i in a slot of the history."""
    return rod + ni[Section.POSITIONS] + 3 * (slot * ni[Header.NODES] + i)


@ti.func
def orientation_at(ni: ti.template(), rod, slot, i):
    """Offset of the orientation of edge i in a slot of the history."""
    return rod + ni[Section.ORIENTATIONS] + 4 * (slot * (ni[Header.NODES] - 1) + i)


@ti.func
def hessian_at(ni: ti.template(), rod, step, block):
    """Offset of the Hessian's row of a block: its diagonal 3x3 matrix, then the two below."""
    stored = ti.select(ni[Header.DERIVATIVES] >= Derivatives.ADJOINT, step, 0)
    return rod + ni[Section.HESSIAN] + 27 * (stored * (2 * ni[Header.NODES] - 1) + block)


@ti.func
def hessian_index(ni: ti.template(), rod, step):
    """Place of the first diagonal matrix of the Hessian in `w33`; each block has three matrices."""
    return ti.raw_div(hessian_at(ni, rod, step, 0), 9)


@ti.func
def time_at(ni: ti.template(), rod, step):
    """Offset of the `TimeRow` of a solve."""
    return rod + ni[Section.TIMES] + TIME_WIDTH * step


@ti.func
def parameter_derivatives_at(ni: ti.template(), rod, group, j):
    """Offset of the rows of block j, for a group of parameters."""
    count = 2 * ni[Header.NODES] - 1
    return rod + ni[Section.PARAMETER_DERIVATIVES] + MATRIX_WIDTH * (group * count + j)


@ti.func
def parameter_code_at(ni: ti.template(), p):
    """Place in the integer array of the `Parameter`, knot and knot count of parameter p."""
    return STEP_BLOCKS + ni[Header.HORIZON] + PARAMETER_WIDTH * p


@ti.func
def column_groups(columns):
    """Number of groups of a number of columns."""
    return (columns + (GROUP_COLUMNS - 1)) // GROUP_COLUMNS


@ti.func
def steady_groups(ni: ti.template()):
    """Number of groups of columns for actions and parameters, which come before all others."""
    return ni[Header.ACTION_GROUPS] + column_groups(ni[Header.PARAMETERS])


@ti.func
def sensitivity_columns_at(ni: ti.template(), rod, step, group):
    """Offset of a group of columns of a solve, and the number of groups."""
    groups = steady_groups(ni) + column_groups(ni[Header.STATE_DIRECTIONS])
    size = MATRIX_WIDTH * (2 * ni[Header.NODES] - 1)
    ring = HISTORY_SLOTS + 1
    return rod + ni[Section.SENSITIVITIES] + size * (
        ring * group + (step + HISTORY_SLOTS) % ring
    ), groups


@ti.func
def scalar(ni: ti.template(), w: ti.template(), rod, k):
    """Constant of a rod, named by `Scalar`."""
    return w[rod + ni[Section.SCALARS] + k]
